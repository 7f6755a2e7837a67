//! Units of length as files name them.

/// Names of lengths, each with the name under which it is stated and its metres.
const LENGTHS: [(&str, f64, &[&str]); 12] = [
    ("pm", 1e-12, &["pm", "picometer", "picometre"]),
    ("angstrom", 1e-10, &["angstrom", "å", "a"]),
    ("nm", 1e-9, &["nm", "nanometer", "nanometre", "nanon"]),
    ("um", 1e-6, &["um", "µm", "μm", "\\u00b5m", "\\u03bcm", "micron", "micrometer", "micrometre"]),
    ("mm", 1e-3, &["mm", "millimeter", "millimetre"]),
    ("cm", 1e-2, &["cm", "centimeter", "centimetre"]),
    ("dm", 1e-1, &["dm", "decimeter", "decimetre"]),
    ("m", 1.0, &["m", "meter", "metre"]),
    ("km", 1e3, &["km", "kilometer", "kilometre"]),
    ("inch", 0.0254, &["inch", "inche", "in", "\""]),
    ("ft", 0.3048, &["ft", "foot", "feet"]),
    ("thou", 0.0254e-3, &["thou", "mil"]),
];

/// Words for no unit.
const NOTHING: [&str; 6] = ["pixel", "pixels", "voxel", "voxels", "reference frame", "none"];

/// The name under which a unit is stated, as `um` for micrometres; one that is not known stays as it is, and
/// one that means samples is empty.
pub(super) fn unit_name(name: &str) -> String {
    let name = name.trim();
    let lower = name.to_lowercase();
    if NOTHING.contains(&lower.as_str()) {
        return String::new();
    }
    let one = lower.strip_suffix('s').unwrap_or(&lower);
    let known = |names: &[&str]| names.contains(&lower.as_str()) || names.contains(&one);
    let found = LENGTHS.iter().find(|(_, _, names)| known(names));
    found.map_or(name.into(), |(short, ..)| (*short).into())
}

/// The metres of a unit of length as [`LoadedImage::units`](super::LoadedImage::units) names it, such as `um`; none
/// if it is no length that is known.
///
/// ```
/// assert_eq!(atomesh_io::image::metres("mm"), Some(1e-3));
/// assert_eq!(atomesh_io::image::metres("ms"), None);
/// ```
pub fn metres(unit: &str) -> Option<f64> {
    LENGTHS.iter().find(|(short, ..)| *short == unit).map(|(_, metres, _)| *metres)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn units_are_known_by_their_usual_spellings() {
        for (name, unit) in [
            ("micron", "um"),
            ("Microns", "um"),
            ("µm", "um"),
            ("\\u00B5m", "um"),
            ("inches", "inch"),
            (" mm ", "mm"),
            ("pixels", ""),
            ("parsec", "parsec"),
        ] {
            assert_eq!(unit_name(name), unit);
        }
        // every name that is stated is understood again
        for (short, metre, _) in LENGTHS {
            assert_eq!((unit_name(short).as_str(), metres(short)), (short, Some(metre)));
        }
    }
}
