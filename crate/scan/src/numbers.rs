//! Numbers in small text files, each with the line it stands on.

/// A number and its line, counted from 1.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Number {
    pub value: f64,
    pub line: u32,
}

/// A word that should have been a number.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(crate) struct NotANumber {
    pub word: String,
    pub line: u32,
}

/// Non-empty lines that are no comment, with their numbers counted from 1.
pub(crate) fn lines(text: &str) -> impl Iterator<Item = (u32, &str)> {
    text.trim_start_matches('\u{feff}')
        .lines()
        .zip(1..)
        .map(|(line, number)| (number, line.trim()))
        .filter(|(_, line)| !line.is_empty() && !line.starts_with('#'))
}

/// The words of a line; separators are white space and commas.
pub(crate) fn words(line: &str) -> impl Iterator<Item = &str> {
    line.split(|c: char| c.is_whitespace() || c == ',')
        .filter(|word| !word.is_empty())
}

/// All numbers of a text, in reading order. `nan` and `inf` in any spelling Rust knows are numbers here.
pub(crate) fn numbers(text: &str) -> Result<Vec<Number>, NotANumber> {
    lines(text)
        .flat_map(|(line, content)| words(content).map(move |word| (line, word)))
        .map(|(line, word)| match word.parse() {
            Ok(value) => Ok(Number { value, line }),
            Err(_) => Err(NotANumber {
                word: word.chars().take(40).collect(),
                line,
            }),
        })
        .collect()
}
