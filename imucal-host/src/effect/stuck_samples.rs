//! Repeated samples: `P.stuck_samples`.

use super::{Act, DataRun, Effect, Parameter, Part, SensorKind, Spoils, Words, member_id};

/// Rows that repeat the one before them, at a time.
const LENGTH: usize = 5;
/// Share of the rows that repeat where all stretches follow one another.
const MOST: f64 = LENGTH as f64 / (LENGTH + 1) as f64;

pub(super) fn effect(kind: SensorKind) -> Effect {
    let words = Words {
        cause: "The bus or the logger repeats the last sample now and then, in this share of the rows.",
        remedy: "Mend the transport; leave repeated rows out.",
        needs: "Noise above the converter's step, so that a repeated value is not chance.",
    };
    let share = Parameter::magnitude("share", "-", 0.02, MOST);
    Effect::member(kind, "stuck_samples", Act::Data(kind, alter), vec![share], words)
        .part(Part::Fault(Spoils::Repeats))
        .like(&member_id(kind, "bandwidth"), "the samples themselves: repeated ones are equal in all axes")
}

fn alter(values: &[f64], run: &mut DataRun<'_>) {
    let share = values.first().copied().unwrap_or(0.0);
    for (index, block) in run.samples.chunks_mut(LENGTH + 1).enumerate() {
        if chance(index as u64) < share / MOST
            && let Some((first, rest)) = block.split_first_mut()
        {
            rest.fill(*first);
        }
    }
}

/// A number of [0, 1) for a block, the same in every run: Steele, Lea and Flood's SplitMix64 (2014).
fn chance(index: u64) -> f64 {
    let mut z = index.wrapping_add(1).wrapping_mul(0x9e37_79b9_7f4a_7c15);
    z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
    z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
    ((z ^ (z >> 31)) >> 11) as f64 / (1u64 << 53) as f64
}

#[cfg(test)]
mod tests {
    use nalgebra::Vector3;

    use super::*;

    #[test]
    fn about_the_given_share_of_rows_repeats() {
        let mut samples: Vec<_> = (0..60_000).map(|k| Vector3::repeat(f64::from(k))).collect();
        alter(&[0.1], &mut DataRun { samples: &mut samples });
        let stuck = samples.windows(2).filter(|pair| pair[0] == pair[1]).count() as f64 / 60_000.0;
        assert!((0.09..0.11).contains(&stuck), "{stuck}");
    }
}
