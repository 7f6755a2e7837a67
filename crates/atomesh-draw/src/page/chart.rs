//! Histograms as inline SVG, in the colours of the page.

use std::fmt::Write;

use atomesh::measure::Histogram;

use super::text::{escape, grouped};

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

/// The drawing's size, and the room around its bars: left, right, above, below.
const SIZE: [f64; 2] = [380.0, 190.0];
const ROOM: [f64; 4] = [8.0, 18.0, 34.0, 34.0];

/// Bars kept beyond the first and the last that hold anything.
const BESIDE: usize = 1;

/// Steps of an axis: 1, 2 or 5 times a power of ten.
const STEPS: [f64; 3] = [1.0, 2.0, 5.0];

impl Chart<'_> {
    /// The figure; nothing if there is nothing to count.
    pub fn svg(&self) -> String {
        let counts = &self.histogram.counts;
        let total: u64 = counts.iter().sum();
        let (Some(first), Some(last)) =
            (counts.iter().position(|&c| c > 0), counts.iter().rposition(|&c| c > 0))
        else {
            return String::new();
        };
        let width = self.histogram.width;
        let marked = self.mark.map(|(at, _)| (at / width) as usize).filter(|&i| i < counts.len());
        let first = first.min(marked.unwrap_or(first)).saturating_sub(BESIDE);
        let last = (last.max(marked.unwrap_or(last)) + BESIDE).min(counts.len() - 1);
        let most = counts.iter().copied().max().unwrap_or(1) as f64;
        let (left, bottom) = (ROOM[0], SIZE[1] - ROOM[3]);
        let bar = (SIZE[0] - ROOM[0] - ROOM[1]) / (last - first + 1) as f64;
        let height = bottom - ROOM[2];
        let x = |value: f64| left + bar * (value / width - first as f64);

        let label = format!("Histogram: {}, {} {}", self.title, grouped(total), self.of);
        let mut out = format!(
            "<figure><svg viewBox=\"0 0 {} {}\" role=\"img\" aria-label=\"{}\">\n",
            SIZE[0],
            SIZE[1],
            escape(&label)
        );
        let title = escape(self.title);
        let _ = writeln!(out, "<text class=\"title\" x=\"{left}\" y=\"14\">{title}</text>");
        for (i, &count) in counts.iter().enumerate().take(last + 1).skip(first) {
            if count == 0 {
                continue;
            }
            // a bar with anything in it is seen
            let tall = (height * count as f64 / most).max(1.0);
            let share = 100.0 * count as f64 / total as f64;
            let from = number(i as f64 * width);
            let to = if i + 1 == counts.len() {
                "and more".to_owned()
            } else {
                format!("to {}", number((i + 1) as f64 * width))
            };
            let _ = writeln!(
                out,
                "<rect class=\"bar\" x=\"{:.2}\" y=\"{:.2}\" width=\"{:.2}\" height=\"{tall:.2}\">\
                 <title>{from} {to}{}: {} ({share:.2} %)</title></rect>",
                x(i as f64 * width) + 0.5,
                bottom - tall,
                (bar - 1.0).max(0.5),
                escape(self.unit),
                grouped(count),
            );
        }
        let _ =
            writeln!(out, "<path class=\"axis\" d=\"M{left} {bottom}H{}\"/>", SIZE[0] - ROOM[1]);
        self.ticks(&mut out, (first as f64 * width, (last + 1) as f64 * width), x);
        if let Some((at, name)) = self.mark {
            let (at, name) = (x(at), escape(name));
            let _ =
                writeln!(out, "<path class=\"mark\" d=\"M{at:.2} {}V{bottom}\"/>", ROOM[2] - 6.0);
            let anchor = if at > SIZE[0] / 2.0 { "end" } else { "start" };
            let _ = writeln!(
                out,
                "<text x=\"{at:.2}\" y=\"{}\" text-anchor=\"{anchor}\">{name}</text>",
                ROOM[2] - 9.0
            );
        }
        let _ = writeln!(
            out,
            "</svg><figcaption>{} {}; tallest bar {}</figcaption></figure>",
            grouped(total),
            escape(self.of),
            grouped(most as u64)
        );
        out
    }

    /// Numbers under the axis.
    fn ticks(&self, out: &mut String, (from, to): (f64, f64), x: impl Fn(f64) -> f64) {
        let rough = (to - from) / 6.0;
        let power = 10f64.powf(rough.log10().floor());
        let step = STEPS.into_iter().map(|s| s * power).find(|s| *s >= rough);
        let step = step.unwrap_or(10.0 * power);
        let y = SIZE[1] - ROOM[3];
        let mut i = (from / step - 1e-9).ceil() as i64;
        while (i as f64) * step <= to * (1.0 + 1e-9) {
            let (value, at) = (i as f64 * step, x(i as f64 * step));
            let _ = writeln!(
                out,
                "<path class=\"axis\" d=\"M{at:.2} {y}v4\"/>\
                 <text x=\"{at:.2}\" y=\"{}\" text-anchor=\"middle\">{}{}</text>",
                y + 17.0,
                number(value),
                escape(self.unit)
            );
            i += 1;
        }
    }
}

/// A number of a few digits.
fn number(x: f64) -> String {
    let text = format!("{x:.3}");
    let text = text.trim_end_matches('0').trim_end_matches('.');
    if text == "-0" { "0".into() } else { text.into() }
}
