//! Histograms as inline SVG, in the colours of the page.

use std::fmt::Write;

use atomesh::measure::Histogram;

use super::text::{escape, grouped};
use crate::ticks::{number, ticks};

/// A histogram and what it shows.
pub(super) struct Chart<'a> {
    pub title: &'a str,
    /// What is counted, as in "cells".
    pub of: &'a str,
    /// The unit of the axis, or nothing.
    pub unit: &'a str,
    pub histogram: &'a Histogram,
    /// A value to mark, and what it is: a floor, an ideal.
    pub mark: Option<(f64, &'a str)>,
}

/// The size of the figure, and the room around its bars: left, right, above, below.
const SIZE: [f64; 2] = [380.0, 190.0];
const ROOM: [f64; 4] = [8.0, 18.0, 34.0, 34.0];

/// Empty classes shown beyond the first and the last that are not empty.
const BESIDE: usize = 1;

/// The classes of the histogram that are shown, and their places.
struct Axis {
    first: usize,
    last: usize,
    /// The width of a class, and of its bar in pixels.
    class: f64,
    bar: f64,
}

/// The lower end of the bars.
const BOTTOM: f64 = SIZE[1] - ROOM[3];

impl Axis {
    /// The lower bounds of the first class and of the one beyond the last.
    fn ends(&self) -> [f64; 2] {
        [self.first as f64 * self.class, (self.last + 1) as f64 * self.class]
    }

    /// Where a value is, in pixels.
    fn x(&self, value: f64) -> f64 {
        ROOM[0] + self.bar * (value / self.class - self.first as f64)
    }
}

impl Chart<'_> {
    /// The figure; nothing if there is nothing to count.
    pub fn svg(&self) -> String {
        let Some(axis) = self.axis() else { return String::new() };
        let total: u64 = self.histogram.counts.iter().sum();
        let most = self.histogram.counts.iter().copied().max().unwrap_or(1);
        let label = format!("Histogram: {}, {} {}", self.title, grouped(total), self.of);
        let mut out = format!(
            "<figure><svg viewBox=\"0 0 {} {}\" role=\"img\" aria-label=\"{}\">\n",
            SIZE[0],
            SIZE[1],
            escape(&label)
        );
        let (left, title) = (ROOM[0], escape(self.title));
        let _ = writeln!(out, "<text class=\"title\" x=\"{left}\" y=\"14\">{title}</text>");
        self.bars(&mut out, &axis, total, most);
        let right = SIZE[0] - ROOM[1];
        let _ = writeln!(out, "<path class=\"axis\" d=\"M{left} {BOTTOM}H{right}\"/>");
        self.ticks(&mut out, &axis);
        if let Some((at, name)) = self.mark {
            mark(&mut out, axis.x(at), name);
        }
        let _ = writeln!(
            out,
            "</svg><figcaption>{} {}; tallest bar {}</figcaption></figure>",
            grouped(total),
            escape(self.of),
            grouped(most)
        );
        out
    }

    /// From the first class that is not empty, or has the mark, to the last, and [`BESIDE`] more; `None` if all are empty.
    fn axis(&self) -> Option<Axis> {
        let counts = &self.histogram.counts;
        let first = counts.iter().position(|&c| c > 0)?;
        let last = counts.iter().rposition(|&c| c > 0)?;
        let class = self.histogram.width;
        let marked = self.mark.map(|(at, _)| (at / class) as usize).filter(|&i| i < counts.len());
        let first = first.min(marked.unwrap_or(first)).saturating_sub(BESIDE);
        let last = (last.max(marked.unwrap_or(last)) + BESIDE).min(counts.len() - 1);
        let bar = (SIZE[0] - ROOM[0] - ROOM[1]) / (last - first + 1) as f64;
        Some(Axis { first, last, class, bar })
    }

    fn bars(&self, out: &mut String, axis: &Axis, total: u64, most: u64) {
        let counts = &self.histogram.counts;
        for (i, &count) in counts.iter().enumerate().take(axis.last + 1).skip(axis.first) {
            if count == 0 {
                continue;
            }
            // no bar of a class that is not empty is invisible
            let tall = ((BOTTOM - ROOM[2]) * count as f64 / most as f64).max(1.0);
            let share = 100.0 * count as f64 / total as f64;
            let from = number(i as f64 * axis.class);
            let to = if i + 1 == counts.len() {
                "and more".to_owned()
            } else {
                format!("to {}", number((i + 1) as f64 * axis.class))
            };
            let _ = writeln!(
                out,
                "<rect class=\"bar\" x=\"{:.2}\" y=\"{:.2}\" width=\"{:.2}\" height=\"{tall:.2}\">\
                 <title>{from} {to}{}: {} ({share:.2} %)</title></rect>",
                axis.x(i as f64 * axis.class) + 0.5,
                BOTTOM - tall,
                (axis.bar - 1.0).max(0.5),
                escape(self.unit),
                grouped(count),
            );
        }
    }

    /// Numbers under the axis.
    fn ticks(&self, out: &mut String, axis: &Axis) {
        let [from, to] = axis.ends();
        for value in ticks([from, to], 6.0) {
            let at = axis.x(value);
            let _ = writeln!(
                out,
                "<path class=\"axis\" d=\"M{at:.2} {BOTTOM}v4\"/>\
                 <text x=\"{at:.2}\" y=\"{}\" text-anchor=\"middle\">{}{}</text>",
                BOTTOM + 17.0,
                number(value),
                escape(self.unit)
            );
        }
    }
}

/// A line across the bars, with its name above.
fn mark(out: &mut String, at: f64, name: &str) {
    let name = escape(name);
    let _ = writeln!(out, "<path class=\"mark\" d=\"M{at:.2} {}V{BOTTOM}\"/>", ROOM[2] - 6.0);
    let anchor = if at > SIZE[0] / 2.0 { "end" } else { "start" };
    let _ = writeln!(
        out,
        "<text x=\"{at:.2}\" y=\"{}\" text-anchor=\"{anchor}\">{name}</text>",
        ROOM[2] - 9.0
    );
}
