//! Which pages of a file are those of the image: the largest ones. Others are thumbnails, levels of a pyramid, masks.

use super::super::error::ReadReason;
use super::super::note::ReadNote;
use super::page::Page;

/// The pages of a file, and which are marked as copies of others.
#[derive(Default)]
pub(super) struct Pages(Vec<(Page, bool)>);

impl Pages {
    pub fn push(&mut self, page: Page, is_copy: bool) {
        self.0.push((page, is_copy));
    }

    /// The largest page, and the numbers of those like it; what is left out is noted.
    ///
    /// # Errors
    /// [`ReadReason::Page`] of a page as large as those, but of another type, and where more pages are of another
    /// shape: such a file is no image with copies.
    pub fn largest(self, notes: &mut Vec<ReadNote>) -> Result<(Page, Vec<usize>), ReadReason> {
        let Self(pages) = self;
        let is_all_copies = pages.iter().all(|(_, is_copy)| *is_copy);
        let counts = |is_copy: bool| is_all_copies || !is_copy;
        let whole = || pages.iter().enumerate().filter(|(_, (_, is_copy))| counts(*is_copy));
        let area = |page: &Page| page.width.saturating_mul(page.height);
        let shape = |page: &Page| (page.width, page.height, page.depth);
        let most = whole().map(|(_, (page, _))| area(page)).max().unwrap_or(0);
        let largest = whole().find(|(_, (page, _))| area(page) == most);
        let Some((first, &(page, _))) = largest else {
            return Err(ReadReason::Truncated { expected: 1, found: 0 });
        };
        let kept: Vec<usize> =
            whole().filter(|(_, (other, _))| *other == page).map(|(number, _)| number).collect();
        for (number, (other, _)) in whole().filter(|(_, (other, _))| *other != page) {
            let alike = whole().filter(|(_, (page, _))| shape(page) == shape(other)).count();
            if area(other) == most || alike > kept.len() {
                let (page, found, expected) = match area(other) == most {
                    true => (number + 1, other.text(), page.text()),
                    false => (first + 1, page.text(), other.text()),
                };
                return Err(ReadReason::Page { page, found, expected });
            }
        }
        if page.depth > 1 && kept.len() > 1 {
            let (page, found) = (2, page.text());
            return Err(ReadReason::Page {
                page,
                found,
                expected: "a single page of such depth".into(),
            });
        }
        if let Some((odd, _)) =
            pages.iter().enumerate().find(|(k, _)| !kept.contains(k)).map(|(_, p)| p)
        {
            let (left_out, count) = (pages.len() - kept.len(), pages.len());
            notes.push(ReadNote::SmallPages { left_out, count, found: odd.text() });
        }
        Ok((page, kept))
    }
}
