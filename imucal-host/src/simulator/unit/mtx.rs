//! Xsens MTx, raw output.
//!
//! Ranges, noise densities and bandwidths: models.md 7, from memory of the data sheet; offsets and misalignments: those
//! of a raw recording of its kind (`imu_tk_xsens`). The magnetometer's 0.5 mG are taken as the noise of a sample. Drift
//! within a recording is judged, some hundredth of the sheet's long-term stability; counts per unit are our choice.

use super::{Sheet, TriadSheet};

const DEGREE: f64 = std::f64::consts::PI / 180.0;

pub(super) static SHEET: Sheet = Sheet {
    name: "MTx (simulated)",
    acc: TriadSheet {
        full_scale: 50.0,
        noise_density: 0.002,
        bandwidth: 30.0,
        instability: 4e-4,
        offset: 1.2,
        misalignment: 0.02,
        scale: 0.01,
        counts_per_unit: 600.0,
    },
    gyr: TriadSheet {
        full_scale: 1200.0 * DEGREE,
        noise_density: 0.1 * DEGREE,
        bandwidth: 40.0,
        instability: 0.01 * DEGREE,
        offset: 3.6 * DEGREE,
        misalignment: 0.05,
        scale: 0.01,
        counts_per_unit: 1500.0,
    },
    mag: TriadSheet {
        full_scale: 75.0,
        noise_density: 0.0158,
        bandwidth: 10.0,
        instability: 5e-3,
        offset: 9.0,
        misalignment: 0.03,
        scale: 0.03,
        counts_per_unit: 400.0,
    },
};
