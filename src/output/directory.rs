//! Results folders, and the treatment of earlier results in them. Nothing is ever deleted except what a stopped run wrote after
//! the checkpoint from which it is resumed.

use super::lock::{self, Lock};
use crate::case::parse::reason;
use crate::error::{Error, Result};
use std::fs;
use std::path::{Path, PathBuf};

/// Files and folders that a run writes; tables (`*.csv`), collections of frames (`*.pvd`), pictures (`*.png`) and meshes (`*.vtu`,
/// `*.inp`) are additional.
const OWN: [&str; 7] = ["run.log", "summary.json", "report.html", "frames", "state", "pictures", "case.json"];
const OWN_EXTENSIONS: [&str; 5] = ["csv", "pvd", "png", "vtu", "inp"];

/// The default results folder of a case: `results/<name of the case file>`.
pub fn default(case: &Path) -> PathBuf {
    Path::new("results").join(case.file_stem().unwrap_or("case".as_ref()))
}

/// Whether [`prepare`] would accept `dir`, as far as can be checked without changing anything: no file is in the way, and the
/// folder is empty unless `force` is given. Call it before long work.
pub fn check(dir: &Path, force: bool) -> Result<()> {
    let in_the_way = |path| Error::file(path, "is in the way and not a folder, choose another one with -o");
    if fs::symlink_metadata(dir).is_err() {
        return match dir.ancestors().skip(1).find(|above| above.exists()) {
            Some(above) if !above.is_dir() => Err(in_the_way(above)),
            _ => Ok(()),
        };
    }
    if !dir.is_dir() {
        return Err(in_the_way(dir));
    }
    if force || list(dir)?.iter().all(|path| is_half(path)) {
        return Ok(());
    }
    let message = "the folder is not empty: choose another one with -o, or give --force to move earlier results aside";
    Err(Error::file(dir, message))
}

/// Prepares `dir` for a run. Call it after the case has been checked and its mesh built, so that bad input never touches
/// earlier results.
///
/// A folder that is not empty is refused unless `force` is given. In that case the files of an earlier run are moved to
/// `dir/previous-1` (or the next free number); what a run was killed in the midst of writing is removed, and everything else stays
/// in place. The caller owns the folder exclusively while it holds the returned lock.
pub fn prepare(dir: &Path, force: bool) -> Result<Lock> {
    check(dir, force)?;
    fs::create_dir_all(dir).map_err(|e| Error::file(dir, format!("cannot create the folder: {}", reason(&e))))?;
    let lock = Lock::take(dir)?;
    // another run may have used the folder in between
    check(dir, force)?;
    tidy(dir, usize::MAX)?;
    let own: Vec<PathBuf> = list(dir)?.into_iter().filter(|path| is_own(path)).collect();
    if own.is_empty() {
        return Ok(lock);
    }
    let aside = make_aside(dir)?;
    for path in own {
        let target = aside.join(path.file_name().unwrap_or_default());
        fs::rename(&path, &target).map_err(|e| Error::file(&path, format!("cannot be moved aside: {}", reason(&e))))?;
    }
    Ok(lock)
}

/// Removes what a stopped run left after its checkpoint: incomplete files, and frames and pictures from number `frames` on.
pub fn tidy(dir: &Path, frames: usize) -> Result<()> {
    for folder in ["", "frames", "state"].map(|name| dir.join(name)).into_iter().filter(|folder| folder.is_dir()) {
        for path in list(&folder)?.into_iter().filter(|path| path.is_file()) {
            let name = path.file_name().and_then(|n| n.to_str()).unwrap_or_default();
            let number = name.split_once('-').filter(|(n, _)| n.len() == 4).and_then(|(n, _)| n.parse::<usize>().ok());
            let later =
                [".vtu", ".vtp", ".png"].iter().any(|end| name.ends_with(end)) && number.is_some_and(|n| n >= frames);
            if later || is_half(&path) {
                fs::remove_file(&path).map_err(|e| Error::file(&path, reason(&e)))?;
            }
        }
    }
    Ok(())
}

fn list(dir: &Path) -> Result<Vec<PathBuf>> {
    let fail = |e: std::io::Error| Error::file(dir, reason(&e));
    let entries = fs::read_dir(dir).map_err(fail)?;
    let paths = entries.map(|entry| entry.map(|e| e.path()).map_err(fail));
    paths.filter(|path| !path.as_ref().is_ok_and(|path| path.ends_with(lock::NAME))).collect()
}

/// Whether a file is incomplete because its run was killed.
fn is_half(path: &Path) -> bool {
    path.extension().is_some_and(|extension| extension == "part")
}

fn is_own(path: &Path) -> bool {
    let name = path.file_name().and_then(|n| n.to_str()).unwrap_or_default();
    let extension = path.extension().and_then(|e| e.to_str()).unwrap_or_default();
    OWN.contains(&name) || OWN_EXTENSIONS.contains(&extension)
}

fn make_aside(dir: &Path) -> Result<PathBuf> {
    let mut number = 1;
    loop {
        let aside = dir.join(format!("previous-{number}"));
        match fs::create_dir(&aside) {
            Ok(()) => return Ok(aside),
            Err(e) if e.kind() == std::io::ErrorKind::AlreadyExists => number += 1,
            Err(e) => return Err(Error::file(&aside, reason(&e))),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn names(dir: &Path) -> Vec<String> {
        let mut names: Vec<_> =
            list(dir).unwrap().iter().map(|p| p.file_name().unwrap().to_str().unwrap().to_string()).collect();
        names.sort();
        names
    }

    #[test]
    fn new_folders_are_made_and_empty_ones_used() {
        let root = tempfile::tempdir().unwrap();
        let dir = root.path().join("a/b");
        prepare(&dir, false).unwrap();
        // a run was killed before it had written its first file
        fs::write(dir.join("case.json.7.part"), "{").unwrap();
        prepare(&dir, false).unwrap();
        assert!(names(&dir).is_empty());
    }

    #[test]
    fn results_are_refused_without_force_and_moved_with_it() {
        let root = tempfile::tempdir().unwrap();
        let dir = root.path();
        fs::write(dir.join("history.csv"), "old").unwrap();
        fs::write(dir.join("notes.txt"), "mine").unwrap();
        fs::create_dir(dir.join("frames")).unwrap();
        let message = prepare(dir, false).unwrap_err().to_string();
        assert!(message.contains("not empty") && message.contains("--force"), "{message}");
        assert_eq!(names(dir), ["frames", "history.csv", "notes.txt"]);
        prepare(dir, true).unwrap();
        assert_eq!(names(dir), ["notes.txt", "previous-1"]);
        fs::write(dir.join("history.csv"), "new").unwrap();
        prepare(dir, true).unwrap();
        assert_eq!(names(dir), ["notes.txt", "previous-1", "previous-2"]);
        assert_eq!(fs::read(dir.join("previous-1/history.csv")).unwrap(), b"old");
        assert_eq!(fs::read(dir.join("previous-2/history.csv")).unwrap(), b"new");
    }

    #[test]
    fn a_file_in_the_way_is_refused() {
        let root = tempfile::tempdir().unwrap();
        let file = root.path().join("file");
        fs::write(&file, "mine").unwrap();
        assert!(prepare(&file, true).unwrap_err().to_string().contains("not a folder"));
        let message = prepare(&file.join("below/further"), true).unwrap_err().to_string();
        assert!(message.contains("file: is in the way"), "{message}");
        assert_eq!(fs::read(&file).unwrap(), b"mine");
    }

    #[cfg(unix)]
    #[test]
    fn a_folder_without_write_permission_is_refused() {
        use std::os::unix::fs::PermissionsExt;
        let root = tempfile::tempdir().unwrap();
        fs::set_permissions(root.path(), fs::Permissions::from_mode(0o555)).unwrap();
        // Permissions do not restrict the superuser.
        if fs::write(root.path().join("probe"), "").is_err() {
            assert_eq!(prepare(root.path(), false).unwrap_err().exit_code(), 4);
        }
        fs::set_permissions(root.path(), fs::Permissions::from_mode(0o755)).unwrap();
    }
}
