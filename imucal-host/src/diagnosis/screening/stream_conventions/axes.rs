//! How the axes of a stream stand to those of the sensor, in words: turned, mirrored, or of the other sign.

use nalgebra::{Matrix3, Rotation3};

use crate::{
    effect::axis_swap::{columns, signed_permutation},
    recording::SensorKind,
};

/// A mount beyond this is reported, rad: five degrees.
const REPORTED: f64 = 0.087;
/// All but the weakest direction of the movement must be at least this share of the strongest to show a turn.
const SHOWN: f64 = 1e-3;

/// All sensors share a right-angled turn.
pub fn turned(code: usize) -> String {
    let frame = match signed_permutation(code) {
        Some(p) if (p[(2, 2)] + 1.0).abs() < 0.5 => "; a simulator with z up has such axes",
        Some(p) if (p[(2, 1)] + 1.0).abs() < 0.5 => "; a simulator with y up has such axes",
        _ => "",
    };
    format!(
        "all sensors are turned by a right angle or more against the simulator's axes: {}, and the others likewise{frame}; \
         the diagnosis goes on with the axes turned; give the simulated sensor the mounting of the real one",
        columns(SensorKind::Acc, code)
    )
}

/// Sensors that differ from the stream by these codes; mirrored where the accelerometer is.
pub fn apart(codes: &[(SensorKind, usize)]) -> String {
    let words: Vec<String> = codes.iter().map(|(kind, code)| columns(*kind, *code)).collect();
    let is_mirrored = |code: usize| signed_permutation(code).is_some_and(|p| p.determinant() < 0.0);
    let acc = codes.iter().find(|(kind, _)| *kind == SensorKind::Acc).map(|(_, code)| *code);
    let why = match acc {
        // Every axis of the accelerometer alone: gravity counted the other way.
        Some(7) if codes.len() == 1 => {
            "the stream holds gravity minus acceleration where specific force, acceleration minus gravity, was expected"
        }
        Some(code) if is_mirrored(code) && codes.len() > 1 => {
            "the simulator's axes are left-handed where right-handed ones were expected"
        }
        _ => "either side may be the wrong one",
    };
    format!(
        "against the simulated stream {}: {why}; the diagnosis goes on with the axes put right; correct the simulator's \
         export, or the sensor's wiring or driver",
        words.join("; ")
    )
}

/// A mount by an angle that is no small one, from Σ y vᵀ of samples y and what they were given; `None` where it is small
/// or not shown.
pub fn mounted(kind: SensorKind, cross: &Matrix3<f64>) -> Option<String> {
    let svd = cross.svd(true, true);
    let (u, v_t) = (svd.u?, svd.v_t?);
    let mut sizes: Vec<f64> = svd.singular_values.iter().copied().collect();
    sizes.sort_by(f64::total_cmp);
    if sizes[1] < SHOWN * sizes[2] {
        return None;
    }
    // The nearest rotation: the weakest direction takes the sign that makes it one.
    let weakest = (0..3).min_by(|a, b| svd.singular_values[*a].total_cmp(&svd.singular_values[*b]))?;
    let mut sign = Matrix3::identity();
    sign[(weakest, weakest)] = (u * v_t).determinant().signum();
    let rotation = Rotation3::from_matrix_unchecked(u * sign * v_t);
    let (axis, angle) = rotation.axis_angle()?;
    (angle > REPORTED).then(|| {
        format!(
            "the {kind} is turned against the simulator's axes by {:.1}° about ({:.2}, {:.2}, {:.2}); the baseline takes it \
             up; give the simulated sensor the mounting of the real one",
            angle.to_degrees(),
            -axis.x,
            -axis.y,
            -axis.z
        )
    })
}

#[cfg(test)]
mod tests {
    use nalgebra::Vector3;

    use super::*;

    #[test]
    fn a_mount_is_reported_from_five_degrees_on() {
        let cross = |degrees: f64| {
            let mount = Rotation3::from_scaled_axis(Vector3::z() * degrees.to_radians());
            // Components go the other way than the sensor.
            mount.inverse().matrix() * Matrix3::from_diagonal(&Vector3::new(4.0, 2.0, 0.3))
        };
        assert_eq!(mounted(SensorKind::Gyr, &cross(3.0)), None);
        let said = mounted(SensorKind::Gyr, &cross(30.0)).unwrap();
        assert!(said.contains("by 30.0° about") && said.contains("1.00)"), "{said}");
        assert_eq!(mounted(SensorKind::Gyr, &Matrix3::from_diagonal(&Vector3::new(1.0, 0.0, 0.0))), None);
    }

    #[test]
    fn mirrored_axes_and_reversed_gravity_are_distinguished() {
        let left = apart(&[(SensorKind::Acc, 2), (SensorKind::Gyr, 5)]);
        assert!(left.contains("acc_y is negated") && left.contains("left-handed"), "{left}");
        assert!(apart(&[(SensorKind::Acc, 7)]).contains("gravity minus acceleration"));
        assert!(apart(&[(SensorKind::Gyr, 2)]).contains("either side"));
        assert!(turned(6).contains("z up") && turned(12).contains("y up"));
    }
}
