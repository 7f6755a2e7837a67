//! The names that groups of facets and regions are given.

/// The name of the group of facets on a mask's outline.
pub const MASK_NAME: &str = "mask";

/// The name of a side of the box: 0 is xmin, 1 xmax, 2 ymin … 5 zmax, along the image's axes.
///
/// # Panics
/// If there is no such side.
pub fn side_name(side: usize) -> &'static str {
    ["xmin", "xmax", "ymin", "ymax", "zmin", "zmax"][side]
}

/// The name of a feature by its number, from 1 on: `feature-1`.
pub fn feature_name(number: u32) -> String {
    format!("feature-{number}")
}

/// Whether a name is one that [`feature_name`] gives.
pub fn is_feature_name(name: &str) -> bool {
    name.strip_prefix("feature-").is_some_and(|number| number.parse::<u32>().is_ok())
}

/// The name of a point that was to stay where it is, such as a well, by its number from 1 on: `well-1`.
pub fn well_name(number: u32) -> String {
    format!("well-{number}")
}

/// The name of the facets between cells of two labels, the lower first: `interface-2-5`.
pub fn interface_name(labels: [i32; 2]) -> String {
    format!("interface-{}-{}", labels[0], labels[1])
}

/// The name of a region that has none of its own: `region-7`.
pub fn region_name(id: i32) -> String {
    format!("region-{id}")
}
