//! Suggestions for a misspelt name.

/// `; did you mean `x`?` when a name is close, and the allowed names.
pub fn advice<'a>(name: &str, allowed: impl IntoIterator<Item = &'a str>) -> String {
    let allowed: Vec<&str> = allowed.into_iter().collect();
    let near = allowed.iter().map(|a| (distance(name, a), *a)).min().filter(|&(d, a)| {
        let length = name.chars().count().max(a.len());
        d <= length.div_ceil(3) || !name.is_empty() && (a.starts_with(name) || name.starts_with(a))
    });
    let guess = near.map(|(_, a)| format!("did you mean `{a}`? ")).unwrap_or_default();
    format!("{guess}allowed: {}", allowed.join(", "))
}

/// Levenshtein distance of the lower-case names; long names are cut, since no field has more than 40 letters.
fn distance(a: &str, b: &str) -> usize {
    let lower = |s: &str| s.chars().take(60).flat_map(char::to_lowercase).collect::<String>();
    strsim::levenshtein(&lower(a), &lower(b))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn guesses_only_what_is_close() {
        assert!(advice("angle", ["angle_deg", "time_s"]).starts_with("did you mean `angle_deg`?"));
        assert_eq!(advice("colour", ["angle_deg", "time_s"]), "allowed: angle_deg, time_s");
    }
}
