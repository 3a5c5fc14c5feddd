//! Finding ids in text, ranges and lists included: `AMK-SLS-04`, `AMK-SEM-04 to 09`,
//! `ATV-SMS-03, 04, 08`, `DEC-05`.

/// Documents an id may come from.
const PREFIXES: [&str; 7] = ["AMKP-", "AMKD-", "AMK-", "LNZ-", "ATV-", "ETG-", "DEC-"];

/// Ids in one line of text.
pub fn in_line(line: &str) -> Vec<String> {
    let mut found = Vec::new();
    let mut rest = line;
    let mut before: Option<char> = None;
    while let Some(first) = rest.chars().next() {
        let starts_a_word = before.is_none_or(|letter| !letter.is_ascii_alphanumeric() && letter != '-');
        let id = if starts_a_word { id_at(rest) } else { None };
        if let Some((stem, number, length)) = id {
            let after = &rest[length..];
            found.push(format!("{stem}{number}"));
            found.extend(continued(stem, number, after));
            before = rest[..length].chars().last();
            rest = after;
        } else {
            before = Some(first);
            rest = &rest[first.len_utf8()..];
        }
    }
    found
}

/// An id at the start of `text`: everything before its number, the number, its length.
fn id_at(text: &str) -> Option<(&str, &str, usize)> {
    let prefix = PREFIXES.iter().find(|prefix| text.starts_with(**prefix))?;
    let mut at = prefix.len();
    if *prefix != "DEC-" {
        let area = leading(&text[at..], |letter| letter.is_ascii_uppercase() || letter.is_ascii_digit());
        if area == 0 || !text[at + area..].starts_with('-') {
            return None;
        }
        at += area + 1;
    }
    let mut digits = leading(&text[at..], |letter| letter.is_ascii_digit());
    if digits == 0 {
        return None;
    }
    // One letter may follow, as in a requirement that was split.
    let tail = &text[at + digits..];
    let letter = leading(tail, |letter| letter.is_ascii_uppercase());
    if letter == 1 {
        digits += 1;
    }
    let ends_a_word = text[at + digits..]
        .chars()
        .next()
        .is_none_or(|letter| !letter.is_ascii_alphanumeric() && letter != '-');
    ends_a_word.then(|| (&text[..at], &text[at..at + digits], at + digits))
}

fn leading(text: &str, is: impl Fn(char) -> bool) -> usize {
    text.find(|letter| !is(letter)).unwrap_or(text.len())
}

/// What follows an id as a range or a list of numbers of the same area.
fn continued(stem: &str, number: &str, after: &str) -> Vec<String> {
    let mut found = Vec::new();
    let mut rest = after;
    let mut last: Option<u32> = number.parse().ok();
    let width = number.len();
    loop {
        let separators = [", ", " to ", " and "];
        let Some(separator) = separators.iter().find(|separator| rest.starts_with(**separator)) else {
            return found;
        };
        let tail = &rest[separator.len()..];
        let digits = leading(tail, |letter| letter.is_ascii_digit());
        let next: Option<u32> = tail[..digits].parse().ok();
        let ends = tail[digits..]
            .chars()
            .next()
            .is_none_or(|letter| !letter.is_ascii_alphanumeric() && letter != '-');
        let (Some(from), Some(to)) = (last, next) else { return found };
        if digits != width || !ends || to <= from {
            return found;
        }
        let first = if *separator == " to " { from + 1 } else { to };
        found.extend((first..=to).map(|number| format!("{stem}{number:0width$}")));
        last = Some(to);
        rest = &tail[digits..];
    }
}
