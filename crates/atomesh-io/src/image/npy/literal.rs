//! The words of a Python literal.

use super::super::error::ReadReason;
use super::super::text::shortened;
use super::FORMAT;

/// The error for an entry of the header.
pub(super) fn wrong(field: &'static str, value: &str, expected: &'static str) -> ReadReason {
    ReadReason::Header { format: FORMAT, field, value: shortened(value), expected }
}

/// Takes the words of a Python literal one by one.
pub(super) struct Words<'a> {
    pub rest: &'a str,
}

impl<'a> Words<'a> {
    /// Takes `word` if it is the next one.
    pub fn skip(&mut self, word: &str) -> bool {
        self.rest = self.rest.trim_start();
        match self.rest.strip_prefix(word) {
            Some(rest) => {
                self.rest = rest;
                true
            }
            None => false,
        }
    }

    /// Takes `word`, which must be the next one.
    pub fn expect(&mut self, word: &'static str) -> Result<(), ReadReason> {
        if self.skip(word) { Ok(()) } else { Err(wrong("text", self.rest, word)) }
    }

    /// Takes a string in single or double quotes; the strings of headers have no escapes.
    pub fn quoted(&mut self, field: &'static str) -> Result<&'a str, ReadReason> {
        for quote in ["'", "\""] {
            if self.skip(quote) {
                let (inside, rest) = self
                    .rest
                    .split_once(quote)
                    .ok_or_else(|| wrong(field, self.rest, "a closing quote"))?;
                self.rest = rest;
                return Ok(inside);
            }
        }
        if field == "descr" && self.skip("[") {
            return Err(ReadReason::Unsupported {
                format: FORMAT,
                found: "items of several fields".into(),
                expected: "bool, integers and floats of up to 64 bits",
            });
        }
        Err(wrong(field, self.rest, "a string"))
    }

    /// Takes `True` or `False`.
    pub fn truth(&mut self) -> Result<bool, ReadReason> {
        let truth = self.skip("True");
        if truth || self.skip("False") {
            Ok(truth)
        } else {
            Err(wrong("fortran_order", self.rest, "True or False"))
        }
    }

    /// Takes a tuple of whole numbers.
    pub fn tuple(&mut self) -> Result<Vec<usize>, ReadReason> {
        let mut numbers = Vec::new();
        self.expect("(")?;
        while !self.skip(")") {
            self.rest = self.rest.trim_start();
            let end = self.rest.find(|c: char| !c.is_ascii_digit()).unwrap_or(self.rest.len());
            let (digits, rest) = self.rest.split_at(end);
            let number =
                digits.parse().map_err(|_| wrong("shape", self.rest, "whole numbers below 2^64"));
            numbers.push(number?);
            self.rest = rest.strip_prefix('L').unwrap_or(rest); // Python 2 wrote 3L
            if !self.skip(",") {
                self.expect(")")?;
                break;
            }
        }
        Ok(numbers)
    }
}
