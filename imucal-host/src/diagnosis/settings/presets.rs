//! What differs between the sources of a movement.

use super::{
    LibrarySettings, LocationSettings, NoiseSettings, ProposalSettings, Provided, ResidualSettings,
    SearchSettings, Settings, Source, VerdictSettings,
};
use crate::recording::SensorKind;

impl Settings {
    /// Those for a source of the movement.
    pub fn preset(source: Source) -> Self {
        match source {
            Source::Rig => Self::rig(),
            Source::Reference => Self::reference(),
            Source::Pose => Self::pose(),
            Source::Simulator => Self::simulator(),
            Source::Rests => Self::rests(),
        }
    }

    /// A rig: its encoders are exact but for errors that the catalogue holds and for pointing errors at each rest.
    fn rig() -> Self {
        Self {
            source: Provided {
                gimbals: true,
                table: true,
                base: true,
                clock: false,
                clock_rate: false,
                followed: false,
                lags: false,
                position: true,
                placed: false,
                heading: true,
                exact_attitude: true,
            },
            residual: ResidualSettings::default(),
            noise: NoiseSettings::default(),
            library: LibrarySettings::default(),
            search: SearchSettings::default(),
            location: LocationSettings::default(),
            verdict: VerdictSettings::default(),
            proposal: ProposalSettings::default(),
        }
    }

    /// A reference attitude: a hand moves the sensor briskly, and the reference has noise, a filter and a clock of its own.
    fn reference() -> Self {
        let rig = Self::rig();
        Self {
            source: Provided {
                gimbals: false,
                table: true,
                base: true,
                clock: true,
                clock_rate: false,
                followed: false,
                lags: true,
                position: false,
                placed: false,
                heading: true,
                exact_attitude: false,
            },
            residual: ResidualSettings {
                moving_points: 0.0175,
                resting_points: 0.0175,
                points_in_gaps: false,
                leaves_out_passages: true,
                keeps_sensors_without_rows: false,
                ..rig.residual
            },
            noise: NoiseSettings {
                least_scatter: 1e-5,
                sway: &[1, 2, 4, 8, 16, 32],
                whole_blocks: false,
                ..rig.noise
            },
            library: LibrarySettings { places_in_quiet_noise: true, ..rig.library },
            search: SearchSettings { most: 5, staged_start: true, settling: 2, ..rig.search },
            verdict: VerdictSettings {
                confirms_held_out: true,
                only_material: true,
                outweighs_remainder: true,
                carried: 10.0,
                least_of_all: 0.01,
                // An attitude that is off by 0.3°; what a rate is off by, the noise holds.
                reference_errors: [0.05, 0.0, 3.0],
                ..rig.verdict
            },
            location: rig.location,
            proposal: rig.proposal,
        }
    }

    /// A reference attitude and position: where a hand moves the sensor to and fro, its acceleration is known as well as the position.
    fn pose() -> Self {
        let reference = Self::reference();
        Self {
            source: Provided { position: true, placed: true, ..reference.source },
            residual: ResidualSettings { weighs_vibration: true, ..reference.residual },
            verdict: VerdictSettings { errors_from_parts: true, ..reference.verdict },
            ..reference
        }
    }

    /// A simulator's stream: exact, in the sensor's own axes, on a clock of its own; a machine shakes the sensor as no simulator says.
    fn simulator() -> Self {
        let rig = Self::rig();
        Self {
            source: Provided {
                gimbals: false,
                table: true,
                base: false,
                clock: true,
                clock_rate: true,
                followed: true,
                lags: false,
                position: true,
                placed: false,
                heading: false,
                exact_attitude: true,
            },
            residual: ResidualSettings {
                moving_block: 0.05,
                moving_points: 0.0051,
                resting_points: 0.05,
                points_in_gaps: false,
                keeps_sensors_without_rows: false,
                weighs_vibration: true,
                leaves_out_mismatch: true,
                ..rig.residual
            },
            noise: NoiseSettings { knots: 0.5, scatters: false, whole_blocks: false, ..rig.noise },
            library: rig.library,
            search: SearchSettings {
                settling: 1,
                removes_pairs: true,
                settles_classes: true,
                fits_details: true,
                ..rig.search
            },
            verdict: VerdictSettings { confirms_held_out: true, amplitude_errors: 0.0, ..rig.verdict },
            location: rig.location,
            proposal: rig.proposal,
        }
    }

    /// The sensor's own rests: gravity gives their attitude, and nothing the heading.
    fn rests() -> Self {
        let reference = Self::reference();
        Self {
            source: Provided {
                gimbals: false,
                table: false,
                base: false,
                clock: false,
                clock_rate: false,
                followed: false,
                lags: true,
                position: true,
                placed: false,
                heading: false,
                exact_attitude: true,
            },
            residual: ResidualSettings {
                leaves_out_passages: false,
                coupled: Some(&SensorKind::ALL),
                ..reference.residual
            },
            verdict: VerdictSettings {
                counts_faults: false,
                reference_errors: [0.0, 0.0, reference.verdict.reference_errors[2]],
                ..reference.verdict
            },
            ..reference
        }
    }
}
