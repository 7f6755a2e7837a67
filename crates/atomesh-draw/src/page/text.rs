//! Text and numbers in HTML.

/// The text with HTML's special characters escaped.
pub(super) fn escape(text: &str) -> String {
    let mut out = String::with_capacity(text.len());
    for letter in text.chars() {
        match letter {
            '&' => out.push_str("&amp;"),
            '<' => out.push_str("&lt;"),
            '>' => out.push_str("&gt;"),
            '"' => out.push_str("&quot;"),
            '\'' => out.push_str("&#39;"),
            _ => out.push(letter),
        }
    }
    out
}

/// A count with a thin space between thousands.
pub(super) fn grouped(count: u64) -> String {
    let digits = count.to_string();
    let mut out = String::new();
    for (i, digit) in digits.chars().enumerate() {
        if i > 0 && (digits.len() - i).is_multiple_of(3) {
            out.push('\u{202f}');
        }
        out.push(digit);
    }
    out
}

/// A number with four significant digits, or all digits of its whole part.
pub(super) fn real(x: f64) -> String {
    if x == 0.0 {
        return "0".into();
    }
    let size = x.abs();
    if !x.is_finite() {
        x.to_string()
    } else if !(1e-3..1e7).contains(&size) {
        format!("{x:.2e}")
    } else {
        let before = size.log10().floor() as i32;
        format!("{x:.*}", (3 - before).max(0) as usize)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn markup_is_spelt_out() {
        assert_eq!(escape("<a href=\"x\">&'"), "&lt;a href=&quot;x&quot;&gt;&amp;&#39;");
    }

    #[test]
    fn numbers_have_four_digits_and_counts_their_thousands() {
        let shown = [0.0, 0.95512, 21.0456, 1234.5678, 123_456.7, 2.3e-15, 7e9, -0.25].map(real);
        let expected = ["0", "0.9551", "21.05", "1235", "123457", "2.30e-15", "7.00e9", "-0.2500"];
        assert_eq!(shown, expected);
        let counts = [7, 999, 1000, 1_234_567].map(grouped);
        assert_eq!(counts, ["7", "999", "1\u{202f}000", "1\u{202f}234\u{202f}567"]);
    }
}
