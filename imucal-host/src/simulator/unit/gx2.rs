//! MicroStrain 3DM-GX2, raw output.
//!
//! Ranges and noise densities: models.md 7, from memory of the data sheet; where it gives a range, its middle. It gives
//! no bandwidth, so that those of the MTx stand in. Offsets: the sheet's bias stability, several times over as raw
//! sensors have it. Drift within a recording is judged, counts per unit are our choice.

use super::{Sheet, TriadSheet};
use crate::recording::unit::STANDARD_GRAVITY;

const DEGREE: f64 = std::f64::consts::PI / 180.0;

pub(super) static SHEET: Sheet = Sheet {
    name: "3DM-GX2 (simulated)",
    acc: TriadSheet {
        full_scale: 5.0 * STANDARD_GRAVITY,
        noise_density: 4e-4 * STANDARD_GRAVITY,
        bandwidth: 30.0,
        instability: 6e-4,
        offset: 0.5,
        misalignment: 0.02,
        scale: 0.01,
        counts_per_unit: 620.0,
    },
    gyr: TriadSheet {
        full_scale: 300.0 * DEGREE,
        noise_density: 0.04 * DEGREE,
        bandwidth: 40.0,
        instability: 0.008 * DEGREE,
        offset: 2.0 * DEGREE,
        misalignment: 0.03,
        scale: 0.01,
        counts_per_unit: 5800.0,
    },
    mag: TriadSheet {
        full_scale: 120.0,
        noise_density: 0.024,
        bandwidth: 10.0,
        instability: 0.01,
        offset: 8.0,
        misalignment: 0.03,
        scale: 0.03,
        counts_per_unit: 250.0,
    },
};
