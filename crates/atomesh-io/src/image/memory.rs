//! Memory for samples: asked for where it can be refused, and not beyond what the caller allows.

use super::error::ReadReason;

/// How much memory there is for samples.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Memory {
    limit: Option<u64>,
}

impl Memory {
    /// At most `limit` bytes for each vector, where there is a limit.
    pub fn up_to(limit: Option<u64>) -> Self {
        Self { limit }
    }

    /// Refuses bytes that are more than there are.
    pub fn check(self, bytes: u128) -> Result<(), ReadReason> {
        match self.limit.filter(|&limit| bytes > u128::from(limit)) {
            Some(_) => Err(self.refusal(bytes)),
            None => Ok(()),
        }
    }

    fn refusal(self, bytes: u128) -> ReadReason {
        ReadReason::Memory { bytes, limit: self.limit }
    }

    /// Reserves memory for `count` samples in all.
    pub fn reserve<T>(self, samples: &mut Vec<T>, count: usize) -> Result<(), ReadReason> {
        let bytes = count as u128 * size_of::<T>() as u128;
        self.check(bytes)?;
        let more = count.saturating_sub(samples.len());
        samples.try_reserve_exact(more).map_err(|_| self.refusal(bytes))
    }

    /// Reserves memory for `wanted` more samples: twice what is reserved, but at most `count` or the limit in all.
    pub fn grow<T>(
        self,
        samples: &mut Vec<T>,
        wanted: usize,
        count: usize,
    ) -> Result<(), ReadReason> {
        if samples.capacity() - samples.len() >= wanted {
            return Ok(());
        }
        let most = self.limit.map_or(u64::MAX, |limit| limit / size_of::<T>().max(1) as u64);
        let most = count.min(usize::try_from(most).unwrap_or(usize::MAX));
        let room = samples.capacity().saturating_mul(2).min(most).max(samples.len() + wanted);
        self.reserve(samples, room)
    }

    /// A vector of `count` zeros.
    pub fn zeros<T: Copy + Default>(self, count: usize) -> Result<Vec<T>, ReadReason> {
        let mut samples = Vec::new();
        self.reserve(&mut samples, count)?;
        samples.resize(count, T::default());
        Ok(samples)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_beyond_the_limit_or_the_system_is_refused_with_both_numbers() {
        let small = Memory::up_to(Some(1000));
        assert_eq!(small.zeros::<u16>(500).unwrap(), [0; 500]);
        let text = small.zeros::<u16>(501).unwrap_err().to_string();
        assert!(text.contains("1002 bytes") && text.contains("1000 are left"), "{text}");
        let mut samples = vec![1_u8; 900];
        assert!(small.grow(&mut samples, 100, 2000).is_ok());
        samples.resize(samples.capacity(), 0);
        assert!(small.grow(&mut samples, 100, 2000).is_err());
        // and what no system has is no abort
        assert!(Memory::default().zeros::<u64>(usize::MAX / 8).is_err());
    }
}
