//! The body of a PLY file as rows of numbers, whatever its encoding.

use super::PlyError;
use super::header::{Element, Encoding, Header, Scalar};

/// The numbers of one row, kept between rows to save their memory.
pub(super) struct Row {
    /// One per property; unused for lists.
    pub(super) values: Vec<f64>,
    /// One per property; unused for single numbers.
    pub(super) lists: Vec<Vec<f64>>,
}

impl Row {
    pub(super) fn of(element: &Element) -> Self {
        Self {
            values: vec![0.0; element.properties.len()],
            lists: vec![Vec::new(); element.properties.len()],
        }
    }
}

/// A cursor in the body.
pub(super) struct Body<'a> {
    encoding: Encoding,
    /// Bytes not yet read.
    rest: &'a [u8],
    /// Text only: what is left of the current line, and its number.
    words: &'a [u8],
    line: usize,
}

impl<'a> Body<'a> {
    pub(super) fn new(data: &'a [u8], header: &Header) -> Self {
        Self {
            encoding: header.encoding,
            rest: data.get(header.bytes..).unwrap_or_default(),
            words: &[],
            line: header.lines,
        }
    }

    /// Reads row `index` of `element` into `row`.
    pub(super) fn read_row(
        &mut self,
        element: &Element,
        index: u64,
        row: &mut Row,
    ) -> Result<(), PlyError> {
        if self.encoding == Encoding::Ascii && !self.next_line() {
            return Err(truncated(element, index));
        }
        for (at, property) in element.properties.iter().enumerate() {
            let mut next = |kind: Scalar| match self.encoding {
                Encoding::Ascii => self.next_word(kind).map_err(|found| PlyError::Value {
                    line: self.line,
                    element: element.name.clone(),
                    index,
                    property: property.name.clone(),
                    expected: kind.describe(),
                    found,
                }),
                _ => self
                    .next_binary(kind)
                    .ok_or_else(|| truncated(element, index)),
            };
            match property.length {
                None => row.values[at] = next(property.value)?,
                Some(length) => {
                    let count = next(length)? as u64;
                    row.lists[at].clear();
                    for _ in 0..count {
                        row.lists[at].push(next(property.value)?);
                    }
                }
            }
        }
        Ok(())
    }

    fn next_binary(&mut self, kind: Scalar) -> Option<f64> {
        let (bytes, rest) = self.rest.split_at_checked(kind.bytes())?;
        self.rest = rest;
        // Little endian, then the type says how many of the eight count.
        let mut le = [0; 8];
        le[..bytes.len()].copy_from_slice(bytes);
        if self.encoding == Encoding::BigEndian {
            le[..bytes.len()].reverse();
        }
        let bits = u64::from_le_bytes(le);
        Some(match kind {
            Scalar::I8 => f64::from(bits as i8),
            Scalar::U8 => f64::from(bits as u8),
            Scalar::I16 => f64::from(bits as i16),
            Scalar::U16 => f64::from(bits as u16),
            Scalar::I32 => f64::from(bits as i32),
            Scalar::U32 => f64::from(bits as u32),
            Scalar::F32 => f64::from(f32::from_bits(bits as u32)),
            Scalar::F64 => f64::from_bits(bits),
        })
    }

    /// Moves to the next line that is not blank.
    fn next_line(&mut self) -> bool {
        while !self.rest.is_empty() {
            let end = self.rest.iter().position(|&byte| byte == b'\n');
            let (line, rest) = match end {
                Some(end) => (&self.rest[..end], &self.rest[end + 1..]),
                None => (self.rest, &[][..]),
            };
            (self.words, self.rest) = (line.trim_ascii(), rest);
            self.line += 1;
            if !self.words.is_empty() {
                return true;
            }
        }
        false
    }

    /// The next number of the line, or what is there instead.
    fn next_word(&mut self, kind: Scalar) -> Result<f64, String> {
        let end = self.words.iter().position(u8::is_ascii_whitespace);
        let (word, rest) = self.words.split_at(end.unwrap_or(self.words.len()));
        self.words = rest.trim_ascii_start();
        let number = std::str::from_utf8(word)
            .ok()
            .and_then(|word| word.parse().ok());
        let whole = !matches!(kind, Scalar::F32 | Scalar::F64);
        match number {
            Some(number) if !whole || f64::fract(number) == 0.0 => Ok(number),
            _ if word.is_empty() => Err("end of line".to_owned()),
            _ => {
                let shown = &word[..word.len().min(40)];
                Err(format!("\"{}\"", String::from_utf8_lossy(shown)))
            }
        }
    }
}

fn truncated(element: &Element, found: u64) -> PlyError {
    PlyError::Truncated {
        element: element.name.clone(),
        expected: element.count,
        found,
    }
}
