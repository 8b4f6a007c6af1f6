//! A disturbance that repeats several times a turn of one gimbal: cogging, a sprocket, the pattern of a slip ring.
//!
//! ```text
//! v += c cos nθ + s sin nθ      n = 3 for the gyroscope, 5 for the others, whose fields turn with the table
//! ```

use super::{amplitudes, mechanism, of, vector};
use crate::{
    effect::{Act, Effect, Truth},
    recording::{GIMBALS, SensorKind},
};

const NAMES: [&str; 6] = ["x_c", "y_c", "z_c", "x_s", "y_s", "z_s"];

/// Alters the truth of a row.
type Alter = fn(&[f64], &mut Truth);

pub(super) fn effects() -> Vec<Effect> {
    let alters: [[Alter; 3]; 3] = [
        [alter::<0, 0>, alter::<0, 1>, alter::<0, 2>],
        [alter::<1, 0>, alter::<1, 1>, alter::<1, 2>],
        [alter::<2, 0>, alter::<2, 1>, alter::<2, 2>],
    ];
    let mut list = Vec::new();
    for (kind, alters) in SensorKind::ALL.into_iter().zip(alters) {
        for (gimbal, alter) in GIMBALS.iter().zip(alters) {
            let parameters = amplitudes(&NAMES, of(kind, 2e-3, 3e-4, 0.05));
            let name = format!("angle_harmonic_{gimbal}");
            let cause = "Something repeats several times a turn of a gimbal.";
            list.push(mechanism(kind, &name, Act::Field(alter), parameters, cause));
        }
    }
    list
}

fn alter<const KIND: usize, const GIMBAL: usize>(values: &[f64], row: &mut Truth) {
    let order = if KIND == 1 { 3.0 } else { 5.0 };
    let (sin, cos) = libm::sincos(order * row.gimbals[GIMBAL].angle);
    let added = vector(values, 0) * cos + vector(values, 3) * sin;
    match KIND {
        0 => row.f_t += added,
        1 => row.w_it_t += added,
        _ => row.b_t += added,
    }
}
