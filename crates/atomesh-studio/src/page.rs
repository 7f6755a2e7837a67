//! The page's files, within the program.

/// A file of the page.
#[derive(Debug)]
pub struct Asset {
    /// Its name.
    pub name: &'static str,
    /// Its media type.
    pub kind: &'static str,
    /// What it holds.
    pub bytes: &'static [u8],
}

/// The files, one a line.
macro_rules! assets {
    ($($name:literal: $kind:literal,)*) => {
        &[$(Asset { name: $name, kind: $kind, bytes: include_bytes!(concat!("../page/", $name)) },)*]
    };
}

/// All files. The page asks for no others.
pub const ASSETS: &[Asset] = assets! {
    "index.html": "text/html; charset=utf-8",
    "icon.svg": "image/svg+xml",
    "studio.css": "text/css; charset=utf-8",
    "main.js": "text/javascript; charset=utf-8",
    "link.js": "text/javascript; charset=utf-8",
    "frames.js": "text/javascript; charset=utf-8",
    "keys.js": "text/javascript; charset=utf-8",
    "view.js": "text/javascript; charset=utf-8",
    "draw.js": "text/javascript; charset=utf-8",
    "space.js": "text/javascript; charset=utf-8",
    "region_colors.js": "text/javascript; charset=utf-8",
    "panel.js": "text/javascript; charset=utf-8",
    "playback.js": "text/javascript; charset=utf-8",
    "stroke.js": "text/javascript; charset=utf-8",
    "tool_look.js": "text/javascript; charset=utf-8",
    "tool_paint.js": "text/javascript; charset=utf-8",
    "tool_atoms.js": "text/javascript; charset=utf-8",
    "tool_regions.js": "text/javascript; charset=utf-8",
    "tool_facets.js": "text/javascript; charset=utf-8",
    "tool_wells.js": "text/javascript; charset=utf-8",
};

#[cfg(test)]
mod tests {
    use super::*;

    /// Bytes that all files may have together.
    const MOST_BYTES: usize = 250_000;

    #[test]
    fn the_page_is_small_and_asks_for_nothing_from_elsewhere() {
        let sum: usize = ASSETS.iter().map(|asset| asset.bytes.len()).sum();
        assert!(sum < MOST_BYTES, "{sum} bytes");
        for asset in ASSETS {
            let text = std::str::from_utf8(asset.bytes).unwrap();
            // the name of a language, which nobody fetches
            let text = text.replace("xmlns=\"http://www.w3.org/2000/svg\"", "");
            for odd in [
                "http://",
                "https://",
                "//cdn",
                "innerHTML",
                "outerHTML",
                "insertAdjacent",
                "eval(",
            ] {
                assert!(!text.contains(odd), "{} has {odd}", asset.name);
            }
        }
    }

    #[test]
    fn the_document_lists_what_the_table_of_keys_does() {
        let keys = ASSETS.iter().find(|asset| asset.name == "keys.js").unwrap();
        let keys = std::str::from_utf8(keys.bytes).unwrap();
        let document = include_str!("../../../docs/studio.md");
        let does = keys.split("does: \"").skip(1).filter_map(|rest| rest.split('"').next());
        let does: Vec<&str> = does.collect();
        assert!(does.len() > 20, "{does:?}");
        for text in does {
            assert!(document.contains(&format!("| {text} |")), "docs/studio.md lacks {text:?}");
        }
    }

    #[test]
    fn every_module_that_is_imported_is_there() {
        for asset in ASSETS.iter().filter(|asset| asset.name.ends_with(".js")) {
            let text = std::str::from_utf8(asset.bytes).unwrap();
            for name in text.split("from \"./").skip(1).filter_map(|rest| rest.split('"').next()) {
                assert!(ASSETS.iter().any(|other| other.name == name), "{}: {name}", asset.name);
            }
        }
    }
}
