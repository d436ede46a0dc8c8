//! The report of a run: one well-formed page that loads nothing and agrees with the tables.

use crate::common::options;
use base64::Engine;
use base64::engine::general_purpose::STANDARD;
use std::fs;
use std::path::Path;
use std::process::Command;
use tempfile::TempDir;
use tricot::output::columns::Columns;
use tricot::rigs::read::read;
use tricot::run::{report, run};

/// A coarse cell with pictures.
const SETS: [&str; 10] = [
    "resolution.warp_columns=6",
    "resolution.weft_columns=4",
    "resolution.slice_mm=0.8",
    "resolution.beams_per_lap=32",
    "steps.0.pretension.time_s=1.5e-4",
    "steps.1.stretch.time_s=2e-5",
    "steps.2.shear.time_s=1e-4",
    "steps.2.shear.angle_deg=3",
    "output.rows_per_step=20",
    "title=Cell <a> & \"b\"",
];

fn ran() -> (TempDir, String) {
    let folder = tempfile::tempdir().unwrap();
    let output = folder.path().join("cell");
    let loaded = read(Path::new("cases/unit_cell_shear.json"), &SETS.map(String::from)).unwrap();
    run(&loaded, &options(output.clone(), 2)).unwrap();
    let text = report(&output, &output.join("report.html")).unwrap();
    assert!(text.contains("report.html written"), "{text}");
    let page = fs::read_to_string(output.join("report.html")).unwrap();
    (folder, page)
}

/// Checks that tags are closed in order and text is escaped; returns the text between tags.
fn well_formed(page: &str) -> Vec<String> {
    let page = page.strip_prefix("<!DOCTYPE html>\n").unwrap();
    let (mut open, mut texts, mut rest) = (Vec::new(), Vec::new(), page);
    while let Some(at) = rest.find('<') {
        let (text, tail) = rest.split_at(at);
        let end = tail.find('>').expect("every tag ends");
        let tag = &tail[1..end];
        assert!(!tag.contains('<'), "{tag}");
        if open.last().is_none_or(|tag| *tag != "style") {
            let entities = ["&amp;", "&lt;", "&gt;", "&quot;"];
            let bare = entities.iter().fold(text.to_owned(), |t, entity| t.replace(entity, ""));
            assert!(!bare.contains(['&', '>']), "{text}");
            texts.push(text.trim().to_owned());
        }
        assert_eq!(tag.matches('"').count() % 2, 0, "{tag}");
        let name = tag.trim_matches('/').split_whitespace().next().unwrap();
        if tag.starts_with('/') {
            assert_eq!(open.pop(), Some(name), "after {text}");
        } else if !tag.ends_with('/') && !["meta", "img"].contains(&name) {
            open.push(name);
        }
        rest = &tail[end + 1..];
    }
    assert!(open.is_empty(), "{open:?}");
    texts
}

#[test]
fn the_page_is_whole_fetches_nothing_and_says_what_the_tables_say() {
    let (folder, page) = ran();
    let dir = folder.path().join("cell");
    let texts = well_formed(&page);
    for outside in ["http:", "https:", "<script", "<link", "url(", "@import"] {
        assert!(!page.contains(outside), "{outside}");
    }
    assert!(texts.contains(&"Cell &lt;a&gt; &amp; &quot;b&quot;".to_owned()));

    // every number of the table is one of the history's
    let history = Columns::read(&dir.join("history.csv")).unwrap();
    let table = page.split("The curve in numbers").nth(1).unwrap().split("</table>").next().unwrap();
    let names: Vec<&str> = table.split("<th>").skip(1).map(|c| c.split('<').next().unwrap()).collect();
    assert!(names.contains(&"shear_angle_deg") && names.contains(&"f_nor_n_per_mm"), "{names:?}");
    let rows: Vec<Vec<&str>> = table
        .split("<tr>")
        .skip(2)
        .map(|r| r.split("<td>").skip(1).map(|c| c.split('<').next().unwrap()).collect())
        .collect();
    assert_eq!(rows.len(), 16);
    let angles = history.numbers("shear_angle_deg");
    for row in &rows {
        let angle: f64 = row[0].parse().unwrap();
        let at = (0..angles.len())
            .rfind(|i| (angles[*i] - angle).abs() <= 1e-4 * angle.abs())
            .expect("a row of the history");
        for (name, cell) in names.iter().zip(row) {
            let (wanted, got): (f64, f64) = (history.numbers(name)[at], cell.parse().unwrap());
            assert!((got - wanted).abs() <= 1e-4 * wanted.abs(), "{name} at {angle}°: {got} for {wanted}");
        }
    }
    assert_eq!(rows.last().unwrap()[0].parse::<f64>().unwrap(), 3.0);

    // sizes before shear are those of the last row before it
    let yarns = Columns::read(&dir.join("yarns.csv")).unwrap();
    let before = history.texts("phase").iter().position(|phase| *phase == "shear").unwrap() - 1;
    for column in ["warp_width_mm", "weft_gap_mm"] {
        let wanted = format!("{:.3} ±", yarns.numbers(column)[before]);
        assert!(page.contains(&wanted), "{column}: {wanted}");
    }
    let summary: serde_json::Value = serde_json::from_slice(&fs::read(dir.join("summary.json")).unwrap()).unwrap();
    assert!(page.contains(summary["state_hash"].as_str().unwrap()));
    let kinetic = summary["worst_kinetic_over_internal_in_shear"].as_f64().unwrap();
    assert_eq!(kinetic > 0.05, page.contains("load more slowly"), "{kinetic}");

    // curves, maps and pictures
    assert!(page.matches("<svg").count() >= 10, "{}", page.matches("<svg").count());
    assert_eq!(page.matches("<circle").count(), 3 * 8);
    let pictures: Vec<&str> =
        page.split("data:image/png;base64,").skip(1).map(|p| p.split('"').next().unwrap()).collect();
    let names = summary["pictures"].as_array().unwrap();
    assert_eq!((pictures.len(), names.len()), (4, 4));
    let first = fs::read(dir.join(names[3].as_str().unwrap())).unwrap();
    assert!(STANDARD.decode(pictures[0]).unwrap() == first, "the last picture comes first, to the byte");
}

#[test]
fn a_run_without_summary_has_a_report_and_a_folder_without_run_has_none() {
    let (folder, _) = ran();
    let dir = folder.path().join("cell");
    fs::remove_file(dir.join("summary.json")).unwrap();
    let out = folder.path().join("page.html");
    let program = |source: &Path| {
        Command::new(env!("CARGO_BIN_EXE_tricot")).arg("report").arg(source).arg("-o").arg(&out).output().unwrap()
    };
    assert!(program(&dir).status.success());
    let page = fs::read_to_string(&out).unwrap();
    well_formed(&page);
    assert!(page.contains("not finished") && page.contains("The curve in numbers"));
    let none = program(folder.path());
    assert_eq!(none.status.code(), Some(4));
    assert!(String::from_utf8_lossy(&none.stderr).contains("no history.csv"));
}
