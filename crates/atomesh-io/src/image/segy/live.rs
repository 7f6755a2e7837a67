//! Which traces have data: all but those that their headers mark as dead, or as dummies that fill gaps.

use super::super::error::ReadReason;
use super::super::memory::Memory;
use super::super::note::ReadNote;
use super::super::traces::NOWHERE;
use super::survey::Survey;
use super::trace::Trace;

/// Says which traces are dead. If all are, the marks mean something else and are taken back.
pub(super) fn note_dead(traces: &mut [Trace], notes: &mut Vec<ReadNote>) {
    let (dead, count) = (traces.iter().filter(|t| t.is_dead).count(), traces.len());
    let Some(first) = traces.iter().position(|t| t.is_dead) else { return };
    if dead == count {
        traces.iter_mut().for_each(|t| t.is_dead = false);
        return notes.push(ReadNote::AllDead { count });
    }
    notes.push(ReadNote::DeadTraces { dead, count, first: first + 1 });
}

/// The place of each trace; [`NOWHERE`] of a dead one.
pub(super) fn live_places(traces: &[Trace], survey: &Survey) -> Vec<usize> {
    let place = |(trace, &place): (&Trace, &usize)| if trace.is_dead { NOWHERE } else { place };
    traces.iter().zip(&survey.places).map(place).collect()
}

/// Whether each of the samples has no trace, the planes of a volume one after another; none if every place has one.
///
/// # Errors
/// [`ReadReason::Memory`] if a byte a sample does not fit.
pub(super) fn absent(
    places: &[usize],
    plane: usize,
    depth: usize,
    memory: Memory,
) -> Result<Option<Vec<bool>>, ReadReason> {
    let mut is_absent = vec![true; plane];
    places.iter().filter(|&&place| place != NOWHERE).for_each(|&place| is_absent[place] = false);
    if !is_absent.contains(&true) {
        return Ok(None);
    }
    let mut absent: Vec<bool> = memory.zeros(plane.saturating_mul(depth))?;
    absent.chunks_exact_mut(plane).for_each(|samples| samples.copy_from_slice(&is_absent));
    Ok(Some(absent))
}
