//! What no effect explains, taken for noise.
//!
//! The noise of a block is estimated together with the effects. Where an effect is missing, or is fitted much too small, the noise that
//! is most likely takes in what it leaves, and nothing then seems to be left. Along a stream the noise of the samples themselves is
//! known from their fourth differences: a mean of several cannot have many times as much.
//!
//! Not modelled: noise that has its power below the rate of the blocks alone.

use crate::{
    diagnosis::{finding::Gap, mixed_model::white_noise::MISFIT},
    effect::si,
    recording::{Recording, SensorKind},
    simulator::replay::readings_noise,
};

/// What is said of each sensor whose noise has taken in a part of the gap.
pub fn remarks(recording: &Recording, gap: &[Gap]) -> Vec<String> {
    let remark = |kind: SensorKind| {
        let sample = readings_noise(&recording.sensor(kind)?.values);
        let of_kind = gap.iter().filter(|row| row.sensor == kind.prefix());
        let block = of_kind.map(|row| row.noise_floor).fold(0.0, f64::max);
        (sample > 0.0 && block > MISFIT * sample).then(|| {
            format!(
                "the noise of the {kind} would have to be {block:.2e} {unit} in a mean over a block, and its samples \
                 have {sample:.2e} {unit}: it holds a part of the gap that no effect explains",
                unit = si(kind)
            )
        })
    };
    SensorKind::ALL.into_iter().filter_map(remark).collect()
}

#[cfg(test)]
mod tests {
    use nalgebra::Vector3;

    use super::*;
    use crate::recording::{Manifest, Nominal, Triple, Unit};

    #[test]
    fn noise_far_above_that_of_the_samples_is_a_part_of_the_gap() {
        let values = (0..2000).map(|row: i32| Vector3::repeat(f64::from(row * 7919 % 13) - 6.0)).collect();
        let unit = Unit::MetrePerSecondSquared;
        let acc = Triple { values, unit, nominal: Nominal::IDENTITY, full_scale: None, single: false };
        let time = (0..2000).map(|row| 0.01 * f64::from(row)).collect();
        let recording = Recording { acc: Some(acc), ..Recording::new("run.csv", Manifest::default(), time) };
        let gap = |noise_floor: f64| Gap {
            sensor: "acc".into(),
            axis: "z".into(),
            unit: "m/s^2".into(),
            rms_before: 1e3,
            rms_after: noise_floor,
            noise_floor,
        };
        let own = readings_noise(&recording.acc.as_ref().unwrap().values);
        assert!(remarks(&recording, &[gap(2.0 * own)]).is_empty());
        let said = remarks(&recording, &[gap(2.0 * own), gap(200.0 * own)]);
        assert!(said.len() == 1 && said[0].contains("the noise of the acc"), "{said:?}");
    }
}
