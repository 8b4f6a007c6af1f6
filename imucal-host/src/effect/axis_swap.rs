//! Axes taken for one another: `P.axis_swap`.

use imucal_core::rotation::axis_order::{self, ORDERS};
use nalgebra::Matrix3;

pub use imucal_core::rotation::axis_order::CODES;

use super::{Act, DataRun, Effect, Parameter, Part, SensorKind, Spoils, Words, member_id};

pub(super) fn effect(kind: SensorKind) -> Effect {
    let words = Words {
        cause: "Columns or axes are in another order or of another sign: code = 8 order + signs, 0 to 47.",
        remedy: "Correct the wiring, the driver or the import; look the axes up in the data sheet.",
        needs: "Input along two axes.",
    };
    Effect::member(kind, "axis_swap", Act::Data(kind, alter), vec![Parameter::choice("code", 47.0)], words)
        .part(Part::Fault(Spoils::Nothing))
        .like(&member_id(kind, "misalignment"), "its size: a swap is a right angle or more")
}

/// The signed permutation of a code: from the axes as they are to the axes as they are recorded. `None` from [`CODES`].
pub fn signed_permutation(code: usize) -> Option<Matrix3<f64>> {
    axis_order::signed_permutation(code)
}

/// The signed permutation nearest to a matrix, by its code, and the angle to it where the matrix is a rotation, rad.
pub fn nearest(matrix: &Matrix3<f64>) -> (usize, f64) {
    let (code, along) = axis_order::nearest(matrix);
    (code, ((along - 1.0) / 2.0).clamp(-1.0, 1.0).acos())
}

/// What the columns of a triad hold under a code, in words: `mag_x is negated`, `acc_x and acc_y are swapped`.
pub fn columns(kind: SensorKind, code: usize) -> String {
    let Some(p) = signed_permutation(code) else { return String::new() };
    let order = ORDERS[code / 8];
    let names = kind.columns();
    let negated: Vec<&str> = (0..3).filter(|k| code >> k & 1 == 1).map(|k| names[k]).collect();
    match (code / 8, negated.as_slice()) {
        (0, []) => format!("{kind} is as it ought to be"),
        (0, [one]) => format!("{one} is negated"),
        (0, [one, two]) => format!("{one} and {two} are negated"),
        (0, _) => format!("{kind} is negated on all axes"),
        (_, []) if p.determinant() < 0.0 => {
            let pair: Vec<&str> = (0..3).filter(|k| order[*k] != *k).map(|k| names[k]).collect();
            format!("{} are swapped", pair.join(" and "))
        }
        _ => {
            let held: Vec<String> = (0..3)
                .map(|k| {
                    format!(
                        "{} holds {}{}",
                        names[k],
                        if negated.contains(&names[k]) { "−" } else { "+" },
                        ["x", "y", "z"][order[k]]
                    )
                })
                .collect();
            held.join(", ")
        }
    }
}

fn alter(values: &[f64], run: &mut DataRun<'_>) {
    let code = values.first().map_or(0, |code| code.round().clamp(0.0, (CODES - 1) as f64) as usize);
    let Some(swap) = signed_permutation(code) else { return };
    run.samples.iter_mut().for_each(|sample| *sample = swap * *sample);
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_code_is_the_nearest_to_its_own_permutation() {
        for code in 0..CODES {
            let (found, angle) = nearest(&signed_permutation(code).unwrap());
            assert_eq!((found, angle), (code, 0.0));
        }
    }

    #[test]
    fn columns_are_named_by_what_they_hold() {
        let code = |p: Matrix3<f64>| nearest(&p).0;
        let swapped = code(Matrix3::new(0.0, 1.0, 0.0, 1.0, 0.0, 0.0, 0.0, 0.0, 1.0));
        let turned = code(Matrix3::new(0.0, -1.0, 0.0, 1.0, 0.0, 0.0, 0.0, 0.0, 1.0));
        assert_eq!(columns(SensorKind::Mag, 1), "mag_x is negated");
        assert_eq!(columns(SensorKind::Acc, 6), "acc_y and acc_z are negated");
        assert_eq!(columns(SensorKind::Acc, swapped), "acc_x and acc_y are swapped");
        assert_eq!(columns(SensorKind::Gyr, turned), "gyr_x holds −y, gyr_y holds +x, gyr_z holds +z");
    }
}
