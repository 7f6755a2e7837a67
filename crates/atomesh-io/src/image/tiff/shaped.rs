//! What `tifffile` says of an array in the description of its first page: `{"shape": [2, 7, 33, 40], "axes": "CZYX"}`.

use super::stack::Counts;

/// How many planes an array of that shape has along each axis, if a text describes an array of pages of
/// `width` × `height` samples, each with so many planes of channels.
///
/// # Errors
/// The shape, if it has several axes of planes and does not name them.
pub(super) fn counts(
    text: &str,
    [width, height]: [usize; 2],
    channel_planes: usize,
) -> Option<Result<Counts, String>> {
    let value: serde_json::Value = serde_json::from_str(text).ok()?;
    let shape: Vec<usize> = serde_json::from_value(value.get("shape")?.clone()).ok()?;
    let mut end = shape.windows(2).rposition(|pair| pair == [height, width])?;
    // planes of the channels of one page
    if channel_planes > 1 && end > 0 && shape[end - 1] == channel_planes {
        end -= 1;
    }
    let planes = &shape[..end];
    let axes = value.get("axes").and_then(|axes| axes.as_str()).unwrap_or_default();
    let axes: Vec<char> = axes.chars().collect();
    let mut counts = Counts::default();
    if axes.len() == shape.len() && axes[..end].iter().all(|axis| "TCZQI".contains(*axis)) {
        for (&count, axis) in planes.iter().zip(axes) {
            match axis {
                'T' => counts.times *= count,
                'C' => counts.channels *= count,
                _ => counts.slices *= count,
            }
        }
        return Some(Ok(counts));
    }
    match planes.iter().filter(|&&count| count > 1).count() {
        ..2 => {
            counts.slices = planes.iter().product();
            Some(Ok(counts))
        }
        _ => Some(Err(format!("{planes:?}"))),
    }
}

/// The axes of the planes, as the description names them, the slowest first.
pub(super) fn order(text: &str) -> String {
    let value: serde_json::Value = serde_json::from_str(text).unwrap_or_default();
    value.get("axes").and_then(|axes| axes.as_str()).unwrap_or_default().into()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn axes_are_those_that_are_named_and_one_without_a_name_is_z() {
        let of = |text: &str| counts(text, [40, 33], 1);
        let counts = |channels, slices, times| Some(Ok(Counts { channels, slices, times }));
        assert_eq!(of(r#"{"shape": [7, 33, 40]}"#), counts(1, 7, 1));
        assert_eq!(of(r#"{"shape": [7, 33, 40, 3]}"#), counts(1, 7, 1));
        assert_eq!(of(r#"{"shape": [7, 33, 40], "axes": "TYX"}"#), counts(1, 1, 7));
        assert_eq!(of(r#"{"shape": [7, 2, 33, 40], "axes": "ZCYX"}"#), counts(2, 7, 1));
        assert_eq!(of(r#"{"shape": [7, 2, 33, 40]}"#), Some(Err("[7, 2]".into())));
        assert_eq!(of(r#"{"shape": [7, 33, 41]}"#), None);
        assert_eq!(of("a picture"), None);
        assert_eq!(super::counts(r#"{"shape": [7, 3, 33, 40]}"#, [40, 33], 3), counts(1, 7, 1));
    }
}
