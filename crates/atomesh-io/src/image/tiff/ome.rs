//! What OME-XML says of a stack in the description of its first page.
//!
//! Definition: the OME data model, <https://docs.openmicroscopy.org/ome-model/>, as far as `Pixels` goes: sizes, the order of
//! planes, which page (`IFD`) holds which plane, and the physical size of samples, in micrometres unless a unit is named.

use roxmltree::{Document, Node};

use super::super::length::{metres, unit_name};
use super::stack::{Counts, Size};

/// The description.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Ome {
    pub counts: Counts,
    /// The page of each plane, channels fastest, then slices, then times; none where another file has it.
    pub pages: Vec<Option<usize>>,
    pub size: Size,
}

/// The most planes that are believed; their places are held.
const MOST_PLANES: usize = 1 << 24;

impl Ome {
    /// The description in a text; none if it is not OME-XML.
    ///
    /// # Errors
    /// What is wrong with it.
    pub fn parse(text: &str, page_count: usize) -> Option<Result<Self, String>> {
        let text = text.trim_start_matches('\u{feff}').trim();
        let is_ome = text.starts_with('<') && text.contains("<OME") || text.contains(":OME");
        is_ome.then(|| {
            let document =
                Document::parse(text).map_err(|e| format!("it is not valid XML: {e}"))?;
            Self::of(document.root_element(), page_count)
        })
    }

    fn of(root: Node<'_, '_>, page_count: usize) -> Result<Self, String> {
        let images = children(root, "Image").count();
        if images != 1 {
            return Err(format!("it describes {images} images; expected one"));
        }
        let pixels = children(root, "Image").flat_map(|image| children(image, "Pixels")).next();
        let pixels = pixels.ok_or("it has no Pixels")?;
        let channels = children(pixels, "Channel").next();
        let per_page = channels.and_then(|c| c.attribute("SamplesPerPixel"));
        let per_page: usize = per_page.and_then(|n| n.parse().ok()).unwrap_or(1).max(1);
        let counts = Counts {
            channels: (count(pixels, "SizeC")? / per_page).max(1),
            slices: count(pixels, "SizeZ")?,
            times: count(pixels, "SizeT")?,
        };
        if counts.planes().is_none_or(|n| n > MOST_PLANES) {
            return Err(format!("it promises {counts:?}, more planes than can be"));
        }
        let order = Order::of(pixels.attribute("DimensionOrder").unwrap_or("XYCZT"), counts)?;
        let pages = pages(pixels, root.attribute("UUID"), &order, page_count)?;
        Ok(Self { counts, pages, size: size(pixels)? })
    }
}

/// The children of a name, whatever their namespace is.
fn children<'a, 'input>(
    node: Node<'a, 'input>,
    name: &'static str,
) -> impl Iterator<Item = Node<'a, 'input>> {
    node.children().filter(move |child| child.tag_name().name() == name)
}

fn count(node: Node<'_, '_>, name: &str) -> Result<usize, String> {
    let text = node.attribute(name).unwrap_or("1");
    let found = text.trim().parse().ok().filter(|&n| n > 0);
    found.ok_or_else(|| format!("{name} is {text:?}; expected a count from 1"))
}

/// In which order planes follow each other.
struct Order {
    counts: Counts,
    /// Which of channel, slice and time is the fastest, the next and the slowest.
    axes: [usize; 3],
}

impl Order {
    fn of(text: &str, counts: Counts) -> Result<Self, String> {
        let axis = |letter: char| "CZT".find(letter);
        let axes: Option<Vec<usize>> =
            text.strip_prefix("XY").and_then(|rest| rest.chars().map(axis).collect());
        let axes = axes.and_then(|axes| <[usize; 3]>::try_from(axes).ok());
        let mut sorted = axes.unwrap_or_default();
        sorted.sort_unstable();
        match axes {
            Some(axes) if sorted == [0, 1, 2] => Ok(Self { counts, axes }),
            _ => Err(format!("DimensionOrder is {text:?}; expected one as XYCZT")),
        }
    }

    fn sizes(&self) -> [usize; 3] {
        [self.counts.channels, self.counts.slices, self.counts.times]
    }

    /// The place in the file's order of a plane's channel, slice and time.
    fn rank(&self, plane: [usize; 3]) -> usize {
        let sizes = self.sizes();
        self.axes.iter().rev().fold(0, |rank, &axis| rank * sizes[axis] + plane[axis])
    }

    /// Channel, slice and time of a place in the file's order, as a number with channels fastest.
    fn plane(&self, mut rank: usize) -> usize {
        let (sizes, mut plane) = (self.sizes(), [0; 3]);
        for axis in self.axes {
            (rank, plane[axis]) = (rank / sizes[axis], rank % sizes[axis]);
        }
        let [c, z, t] = plane;
        c + sizes[0] * (z + sizes[1] * t)
    }
}

/// The page of each plane.
fn pages(
    pixels: Node<'_, '_>,
    file: Option<&str>,
    order: &Order,
    page_count: usize,
) -> Result<Vec<Option<usize>>, String> {
    let total = order.sizes().iter().product();
    let mut pages = vec![None; total];
    let mut data = children(pixels, "TiffData").peekable();
    if data.peek().is_none() {
        (0..total).for_each(|rank| pages[order.plane(rank)] = Some(rank));
        return Ok(pages);
    }
    for block in data {
        let number = |name: &str| match block.attribute(name) {
            None => Ok(None),
            Some(text) => text
                .trim()
                .parse::<usize>()
                .map(Some)
                .map_err(|_| format!("{name} of TiffData is {text:?}; expected a count")),
        };
        let uuid = children(block, "UUID").next().and_then(|uuid| uuid.text());
        if uuid.is_some_and(|uuid| file.is_some_and(|file| file.trim() != uuid.trim())) {
            continue; // planes of another file of the set
        }
        let page = number("IFD")?;
        let rest = if page.is_some() { 1 } else { page_count };
        let plane_count = number("PlaneCount")?.unwrap_or(rest).min(total);
        let first =
            [number("FirstC")?, number("FirstZ")?, number("FirstT")?].map(|n| n.unwrap_or(0));
        if first.iter().zip(order.sizes()).any(|(&n, size)| n >= size) {
            return Err(format!("TiffData begins at {first:?}, outside of {:?}", order.sizes()));
        }
        let ranks = (order.rank(first)..total).take(plane_count);
        for (k, rank) in ranks.enumerate() {
            pages[order.plane(rank)] = Some(page.unwrap_or(0) + k);
        }
    }
    Ok(pages)
}

/// The physical size; that along y and z in the unit of x.
fn size(pixels: Node<'_, '_>) -> Result<Size, String> {
    let axis = |size: &str, unit: &str| {
        let value = pixels.attribute(size).and_then(|text| text.trim().parse::<f64>().ok());
        let value = value.filter(|s| s.is_finite() && *s > 0.0);
        (value, unit_name(pixels.attribute(unit).unwrap_or("um")))
    };
    let [x, y, z] = [
        axis("PhysicalSizeX", "PhysicalSizeXUnit"),
        axis("PhysicalSizeY", "PhysicalSizeYUnit"),
        axis("PhysicalSizeZ", "PhysicalSizeZUnit"),
    ];
    let unit = x.1;
    let in_unit = |(value, own): (Option<f64>, String)| match value {
        Some(value) if own != unit => match (metres(&own), metres(&unit)) {
            (Some(own), Some(unit)) => Ok(Some(value * (own / unit))),
            _ => Err(format!("its sizes are in {unit:?} and {own:?}; expected units of length")),
        },
        value => Ok(value),
    };
    let spacing = [x.0, in_unit(y)?, in_unit(z)?];
    Ok(Size { spacing, unit: if spacing == [None; 3] { String::new() } else { unit } })
}

#[cfg(test)]
mod tests {
    use super::*;

    fn parse(pixels: &str, page_count: usize) -> Result<Ome, String> {
        let text = format!(
            "<?xml version=\"1.0\"?><OME xmlns=\"x\" UUID=\"urn:uuid:1\"><Image>{pixels}</Image></OME>"
        );
        Ome::parse(&text, page_count).unwrap()
    }

    #[test]
    fn planes_are_found_in_the_order_that_is_stated() {
        let ome =
            parse("<Pixels DimensionOrder='XYZCT' SizeC='2' SizeZ='3' SizeT='1'/>", 6).unwrap();
        let pages: Vec<_> = ome.pages.into_iter().flatten().collect();
        assert_eq!(pages, [0, 3, 1, 4, 2, 5]); // channels fastest: z 0 of both, z 1 of both ...
        let blocks = "<Pixels DimensionOrder='XYCZT' SizeC='2' SizeZ='2' SizeT='1'>\
             <TiffData IFD='2' FirstC='0' FirstZ='0'/><TiffData IFD='3' FirstC='1' FirstZ='0'/>\
             <TiffData IFD='0' FirstZ='1' PlaneCount='2'/></Pixels>";
        let pages: Vec<_> = parse(blocks, 4).unwrap().pages.into_iter().flatten().collect();
        assert_eq!(pages, [2, 3, 0, 1]);
        let elsewhere = "<Pixels SizeC='1' SizeZ='2' SizeT='1'>\
             <TiffData IFD='0'><UUID>urn:uuid:1</UUID></TiffData>\
             <TiffData IFD='0' FirstZ='1'><UUID>urn:uuid:2</UUID></TiffData></Pixels>";
        assert_eq!(parse(elsewhere, 1).unwrap().pages, [Some(0), None]);
    }

    #[test]
    fn sizes_are_micrometres_unless_a_unit_is_named() {
        let of =
            |attributes: &str| parse(&format!("<Pixels {attributes}/>"), 1).map(|ome| ome.size);
        let size = of("PhysicalSizeX='0.5' PhysicalSizeY='0.5' PhysicalSizeZ='2.0'").unwrap();
        assert_eq!((size.spacing, size.unit.as_str()), ([Some(0.5), Some(0.5), Some(2.0)], "um"));
        let mixed = of(
            "PhysicalSizeX='2' PhysicalSizeXUnit='µm' PhysicalSizeZ='500' PhysicalSizeZUnit='nm'",
        );
        let spacing = mixed.unwrap().spacing;
        assert_eq!((spacing[0], spacing[1]), (Some(2.0), None));
        assert!((spacing[2].unwrap() - 0.5).abs() < 1e-15); // a rounding of the ratio of units
        let pixels = of("PhysicalSizeX='1' PhysicalSizeXUnit='pixel'").unwrap();
        assert_eq!(pixels.unit, "");
        assert!(of("SizeZ='0'").unwrap_err().contains("SizeZ"));
    }

    #[test]
    fn what_cannot_be_understood_says_so() {
        assert_eq!(Ome::parse("a picture", 1), None);
        assert!(Ome::parse("<OME><Image>", 1).unwrap().unwrap_err().contains("XML"));
        let two = "<OME><Image><Pixels/></Image><Image><Pixels/></Image></OME>";
        assert!(Ome::parse(two, 1).unwrap().unwrap_err().contains("2 images"));
        assert!(parse("<Pixels DimensionOrder='XYCCT'/>", 1).unwrap_err().contains("XYCCT"));
    }
}
