//! The place of a JSON error in a scene: `bodies[3].shapes[0].density`.

use crate::lab::error::LONGEST_MISSPELT;

/// Longer keys are cut in a place, to leave room for the message (characters).
const LONGEST_KEY: usize = 40;

/// One open bracket on the way to a position in the text.
enum OpenBracket {
    /// `{`, with the last key read.
    Object { key: String, expects_key: bool },
    /// `[`, with the index of the current element.
    Array { index: usize },
}

/// The message of a JSON `error` in `text`: place, error, the offending number or the nearest known key if
/// there is one, line and column.
pub(super) fn place_at(text: &str, error: &serde_json::Error) -> String {
    let before = &text.as_bytes()[..offset_of(text, error.line(), error.column())];
    let full = error.to_string();
    let suffix = format!(" at line {} column {}", error.line(), error.column());
    let message = full.strip_suffix(&suffix).unwrap_or(&full);

    let hint = match message {
        m if m.starts_with("number out of range") => {
            format!(" ({})", number_before(&String::from_utf8_lossy(before)))
        }
        m if m.starts_with("unknown field") => nearest_key(m),
        _ => String::new(),
    };
    // For a missing field, the position is after the bracket of the object that lacks it.
    let place = path(&levels_at(before));
    let colon = if place.is_empty() { "" } else { ": " };
    format!("{place}{colon}{message}{hint}{suffix}")
}

/// Byte offset of a one-based line and column (in bytes).
fn offset_of(text: &str, line: usize, column: usize) -> usize {
    let start: usize = text.split_inclusive('\n').take(line.saturating_sub(1)).map(str::len).sum();
    (start + column).min(text.len())
}

/// The brackets that are open at the end of `text`. The text may end anywhere; malformed text only makes the
/// place less exact.
fn levels_at(text: &[u8]) -> Vec<OpenBracket> {
    let mut levels = Vec::new();
    let mut i = 0;
    while i < text.len() {
        match text[i] {
            b'{' => levels.push(OpenBracket::Object { key: String::new(), expects_key: true }),
            b'[' => levels.push(OpenBracket::Array { index: 0 }),
            b'}' | b']' => drop(levels.pop()),
            b',' => match levels.last_mut() {
                Some(OpenBracket::Object { expects_key, .. }) => *expects_key = true,
                Some(OpenBracket::Array { index }) => *index += 1,
                None => {}
            },
            b'"' => {
                let start = i + 1;
                i = start;
                while i < text.len() && text[i] != b'"' {
                    i += if text[i] == b'\\' { 2 } else { 1 };
                }
                let end = i.min(text.len());
                if let Some(OpenBracket::Object { key, expects_key: expects_key @ true }) = levels.last_mut()
                {
                    *key = String::from_utf8_lossy(&text[start..end]).into_owned();
                    *expects_key = false;
                }
            }
            _ => {}
        }
        i += 1;
    }
    levels
}

fn path(levels: &[OpenBracket]) -> String {
    let mut path = String::new();
    for level in levels {
        match level {
            OpenBracket::Object { key, .. } if key.is_empty() => {}
            OpenBracket::Object { key, .. } => {
                path.push_str(if path.is_empty() { "" } else { "." });
                path.extend(key.chars().take(LONGEST_KEY));
                path.push_str(if key.chars().nth(LONGEST_KEY).is_some() { "…" } else { "" });
            }
            OpenBracket::Array { index } => path.push_str(&format!("[{index}]")),
        }
    }
    path
}

/// The number that ends at, or one byte before, the end of `text`.
fn number_before(text: &str) -> &str {
    let is_number = |c: char| c.is_ascii_alphanumeric() || "+-.".contains(c);
    let end = text.trim_end_matches(|c| !is_number(c));
    &end[end.trim_end_matches(is_number).len()..]
}

/// The nearest expected key in serde's "unknown field `a`, expected one of `b`, `c`".
fn nearest_key(message: &str) -> String {
    let mut quoted = message.split('`').skip(1).step_by(2);
    let unknown = quoted.next().unwrap_or_default();
    if unknown.len() > LONGEST_MISSPELT {
        return String::new();
    }
    match quoted.map(|k| (strsim::damerau_levenshtein(k, unknown), k)).min() {
        Some((distance, key)) if distance <= 2 => format!("; did you mean `{key}`?"),
        _ => String::new(),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_place_follows_keys_and_indices() {
        let place = |text: &str| path(&levels_at(text.as_bytes()));
        assert_eq!(place(""), "");
        assert_eq!(place(r#"{"a":"#), "a");
        assert_eq!(place(r#"{"a":[1,{"b":"x,]}","#), "a[1].b");
        assert_eq!(place(r#"{"a":[1,{"b":"x\"","c":[[0,0],[1,"#), "a[1].c[1][1]");
        assert_eq!(place(r#"{"a":[{"b":1}"#), "a[0]");
        assert_eq!(place("]]}}"), "");
        assert_eq!(place(r#"{"unfinished \"#), r"unfinished \");
    }

    #[test]
    fn long_keys_leave_room_for_the_message() {
        let key = "µ".repeat(50_000);
        let text = format!(r#"{{"bodies": [{{"{key}": 1}}]}}"#);
        let error = serde_json::from_str::<crate::lab::scenes::Scene>(&text).unwrap_err();
        let message = crate::lab::error::plain(&place_at(&text, &error));
        assert!(message.starts_with(&format!("bodies[0].{}…: unknown field `µ", &key[..80])), "{message}");
        assert!(message.chars().count() < 430 && message.contains(" at line 1 column "), "{message}");
    }

    #[test]
    fn the_number_is_found_before_the_position() {
        assert_eq!(number_before("[1, 1e999"), "1e999");
        assert_eq!(number_before("[1, -1.5E+400]"), "-1.5E+400");
        assert_eq!(number_before(""), "");
    }
}
