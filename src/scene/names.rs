//! "Did you mean": the known name nearest to one that is not known.

/// The candidate nearest to `name` by edit distance, if it is near enough to be a slip: at most a third of the longer one's letters.
///
/// Upper and lower case, `-` and `_` count as the same. Of equally near candidates the first.
#[must_use]
pub fn nearest<'n>(name: &str, candidates: impl IntoIterator<Item = &'n str>) -> Option<&'n str> {
    let name = normalised(name);
    let mut best: Option<(usize, &str)> = None;
    for candidate in candidates {
        let other = normalised(candidate);
        let distance = edit_distance(&name, &other);
        if distance * 3 <= name.len().max(other.len()) && best.is_none_or(|(least, _)| distance < least) {
            best = Some((distance, candidate));
        }
    }
    best.map(|(_, candidate)| candidate)
}

/// Longest prefix of a name that is compared: names come from files and may have any length.
const MAX_COMPARED: usize = 64;

fn normalised(name: &str) -> Vec<char> {
    name.chars().take(MAX_COMPARED).map(|c| if c == '-' { '_' } else { c.to_ascii_lowercase() }).collect()
}

/// Least number of insertions, deletions, replacements and swaps of neighbours that turn `a` into `b` (optimal string alignment).
fn edit_distance(a: &[char], b: &[char]) -> usize {
    let mut before_last: Vec<usize> = Vec::new();
    let mut last: Vec<usize> = (0..=b.len()).collect();
    for i in 1..=a.len() {
        let mut row = vec![i];
        for j in 1..=b.len() {
            let replaced = last[j - 1] + usize::from(a[i - 1] != b[j - 1]);
            let mut least = replaced.min(last[j] + 1).min(row[j - 1] + 1);
            if i > 1 && j > 1 && a[i - 1] == b[j - 2] && a[i - 2] == b[j - 1] {
                least = least.min(before_last[j - 2] + 1);
            }
            row.push(least);
        }
        before_last = std::mem::replace(&mut last, row);
    }
    last[b.len()]
}

#[cfg(test)]
mod tests {
    use super::*;

    fn distance(a: &str, b: &str) -> usize {
        edit_distance(&normalised(a), &normalised(b))
    }

    #[test]
    fn edit_distance_counts_each_kind_of_slip_once() {
        assert_eq!(distance("camera", "camera"), 0);
        assert_eq!(distance("camera", "camra"), 1);
        assert_eq!(distance("camera", "caamera"), 1);
        assert_eq!(distance("camera", "cameta"), 1);
        assert_eq!(distance("camera", "caemra"), 1);
        assert_eq!(distance("", "abc"), 3);
        assert_eq!(distance("kitten", "sitting"), 3);
    }

    #[test]
    fn nearest_is_a_slip_or_nothing() {
        let names = ["near_m", "far_m", "fov_deg", "position"];
        assert_eq!(nearest("fov_dge", names), Some("fov_deg"));
        assert_eq!(nearest("FOV-degg", names), Some("fov_deg"));
        assert_eq!(nearest("postion", names), Some("position"));
        assert_eq!(nearest("aperture", names), None);
        assert_eq!(nearest(&"x".repeat(1 << 20), names), None);
    }
}
