//! What messages show of words and numbers that others wrote.

/// Most characters of a word that are shown.
const LONGEST: usize = 200;
/// Numbers with more digits than this are shown as powers of ten.
const LONG_NUMBER: usize = 24;

/// A message with quoted words and others cut to a length that can be read, without characters that steer a terminal, and
/// with powers of ten in place of rows of zeros.
pub(crate) fn readable(message: &str) -> String {
    let plain = shown(message);
    let mut out = String::with_capacity(plain.len());
    // Every second part is between quotes.
    for (i, part) in plain.split('`').enumerate() {
        if i > 0 {
            out.push('`');
        }
        if i % 2 == 1 {
            cut(&with_short_numbers(part), &mut out);
        } else {
            part.split_inclusive([' ', '\n'])
                .for_each(|word| cut(&with_short_numbers(word), &mut out));
        }
    }
    out
}

/// Words of which all matters, such as paths, without characters that steer a terminal.
pub(crate) fn shown(text: &str) -> String {
    text.chars().map(|c| if is_steering(c) { '\u{fffd}' } else { c }).collect()
}

fn is_steering(c: char) -> bool {
    // The second part turns the direction in which text runs.
    (c.is_control() && c != '\n') || matches!(c, '\u{202a}'..='\u{202e}' | '\u{2066}'..='\u{2069}')
}

fn with_short_numbers(text: &str) -> String {
    let is_part = |c: char| c.is_ascii_digit() || c == '.';
    let (mut rest, mut short) = (text, String::new());
    while let Some(start) = rest.find(is_part) {
        let (before, from) = rest.split_at(start);
        let (number, after) = from.split_at(from.find(|c| !is_part(c)).unwrap_or(from.len()));
        short.push_str(before);
        match number.parse::<f64>() {
            Ok(value) if number.len() > LONG_NUMBER => short.push_str(&format!("{value:e}")),
            _ => short.push_str(number),
        }
        rest = after;
    }
    short + rest
}

/// Adds a text, or as much of it as is shown.
fn cut(text: &str, out: &mut String) {
    match text.char_indices().nth(LONGEST) {
        Some((end, _)) if !text[end..].trim_end().is_empty() => {
            out.push_str(text[..end].trim_end());
            out.push('…');
            out.push_str(&text[text.trim_end().len()..]);
        }
        _ => out.push_str(text),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn long_words_are_cut_and_the_rest_stays() {
        let message =
            "`scene` is `a.xml`; expected 0.25 to 1e-3, or -12.5 (at 0.30000000000000004)";
        assert_eq!(readable(message), message);
        let long = format!("there is no `{}`; there are a, b", "x".repeat(100_000));
        let cut = readable(&long);
        assert!(cut.len() < 300, "{}", cut.len());
        assert!(
            cut.starts_with("there is no `xxx") && cut.ends_with("x…`; there are a, b"),
            "{cut}"
        );
    }

    #[test]
    fn characters_that_steer_a_terminal_are_gone() {
        let told = readable("`\u{1b}[31mred\u{7}\u{202e}` is\nnot there\r");
        assert_eq!(told, "`\u{fffd}[31mred\u{fffd}\u{fffd}` is\nnot there\u{fffd}");
        let quoted = readable(&format!("`{}` is too long", "a b".repeat(1000)));
        assert!(quoted.len() < 300 && quoted.ends_with("…` is too long"), "{quoted}");
    }

    #[test]
    fn numbers_are_short() {
        for (value, text) in [(1e-300, "1e-300"), (-1e-300, "-1e-300"), (1e300, "1e300")] {
            assert_eq!(
                readable(&format!("`x` is {value}; expected more")),
                format!("`x` is {text}; expected more")
            );
        }
        assert_eq!(readable("1.2.3.4"), "1.2.3.4");
    }
}
