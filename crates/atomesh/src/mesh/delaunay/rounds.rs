//! The order of insertion: rounds of growing density, each along the Hilbert curve.

/// Points that follow each other of which one belongs to a coarser round.
const RATIO: usize = 8;

/// Size of a round that is not divided further.
const LEAST: usize = 64;

/// The ranks below `count` in order of insertion; ranks follow a Hilbert curve.
///
/// Each round keeps one point of every [`RATIO`] that follow each other, at a place scattered by a
/// hash, for the coarser rounds that go before it.
pub(super) fn order(count: usize) -> Vec<u32> {
    let mut rounds: Vec<Vec<u32>> = Vec::new();
    let mut ranks: Vec<u32> = (0..count as u32).collect();
    while ranks.len() > LEAST {
        let mut coarser = Vec::with_capacity(ranks.len() / RATIO + 1);
        let mut round = Vec::with_capacity(ranks.len());
        for block in ranks.chunks(RATIO) {
            let kept = scatter(block[0]) % block.len();
            coarser.push(block[kept]);
            round.extend_from_slice(&block[..kept]);
            round.extend_from_slice(&block[kept + 1..]);
        }
        rounds.push(round);
        ranks = coarser;
    }
    rounds.push(ranks);
    rounds.into_iter().rev().flatten().collect()
}

/// A number without pattern for each rank (Fibonacci hashing).
fn scatter(rank: u32) -> usize {
    (u64::from(rank + 1).wrapping_mul(0x9E37_79B9_7F4A_7C15) >> 40) as usize
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_rank_comes_once() {
        for count in [0, 1, 64, 65, 1000] {
            let mut order = order(count);
            order.sort_unstable();
            assert!(order.iter().copied().eq(0..count as u32));
        }
    }
}
