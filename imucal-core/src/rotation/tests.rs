use super::*;
use nalgebra::Rotation3;
use proptest::prelude::*;

proptest! {
    #[test]
    fn exp_agrees_with_an_independent_rotation(v in prop::array::uniform3(-4.0f64..4.0)) {
        let phi = Vector3::from(v);
        let other = Rotation3::from_scaled_axis(phi).into_inner();
        prop_assert!((exp(&phi) - other).norm() < 1e-14 * 4.0);
        prop_assert!((exp_with_jacobian(&phi).0 - other).norm() < 1e-14 * 4.0);
    }

    #[test]
    fn the_left_jacobian_is_the_derivative(v in prop::array::uniform3(-2.0f64..2.0), d in prop::array::uniform3(-1.0f64..1.0)) {
        let (phi, delta) = (Vector3::from(v), Vector3::from(d) * 1e-6);
        let (_, jacobian) = exp_with_jacobian(&phi);
        let moved = exp(&(phi + delta)) * exp(&(phi - delta)).transpose();
        let skew = (moved - moved.transpose()) * 0.25;
        let numeric = Vector3::new(skew.m32, skew.m13, skew.m21);
        prop_assert!((jacobian * delta - numeric).norm() < 1e-14);
    }
}

/// Rotation vectors in many directions, of angles from tiny to `most`.
fn vectors(most: f64) -> impl Iterator<Item = Vector3<f64>> {
    (0..4000u32).map(move |k| {
        let t = f64::from(k);
        let direction = Vector3::new((1.7 * t).sin(), (2.9 * t + 1.0).cos(), (0.61 * t).cos()).normalize();
        let share = (t + 1.0) / 4000.0;
        direction * most * if k % 2 == 0 { share } else { 10f64.powf(-6.0 * share) }
    })
}

/// Largest errors of the exponential, the quaternion's logarithm, and the logarithm after the exponential.
fn errors<T: Scalar>(most: f64) -> [f64; 3] {
    vectors(most).fold([0.0; 3], |[a, b, c], wide| {
        let phi = wide.map(T::of);
        let given = phi.map(Scalar::wide);
        let (angle, axis) = (given.norm(), given.normalize());
        let exact = Rotation3::from_scaled_axis(given).into_inner();
        let exponential = (exp(&phi).map(Scalar::wide) - exact).amax();
        let half = axis * (0.5 * angle).sin();
        let q = Quaternion::new((0.5 * angle).cos(), half.x, half.y, half.z).coords.map(T::of);
        let relative = if angle < 0.28 { angle } else { 1.0 };
        let q = Quaternion::from_vector(q);
        let logarithm = (quaternion_log(&q).map(Scalar::wide) - given).amax() / relative;
        let back = (log(&exp(&phi)).map(Scalar::wide) - given).amax();
        [a.max(exponential), b.max(logarithm), c.max(back)]
    })
}

#[test]
fn errors_stay_below_those_of_the_table() {
    let below = |errors: [f64; 3], bounds: [f64; 3]| {
        assert!(errors.iter().zip(bounds).all(|(e, b)| *e < b), "{errors:?} against {bounds:?}");
    };
    below(errors::<f64>(0.14), [4e-16, 2e-15, 3e-15]);
    below(errors::<f64>(3.1), [2e-15, 2e-15, 3e-15]);
    below(errors::<f32>(0.14), [2e-7, 6e-7, 2e-6]);
    below(errors::<f32>(3.1), [6e-7, 6e-7, 2e-6]);
}

#[test]
fn a_half_turn_has_a_logarithm_of_pi() {
    for axis in [Vector3::x(), Vector3::y(), Vector3::z(), Vector3::new(0.6f64, 0.0, -0.8)] {
        let phi = log(&exp(&(axis * core::f64::consts::PI)));
        assert!((phi.norm() - core::f64::consts::PI).abs() < 1e-15);
        assert!(phi.cross(&axis).norm() < 1e-15);
    }
}

proptest! {
    #[test]
    fn a_quaternion_and_its_matrix_rotate_alike(v in prop::array::uniform3(-1.8f64..1.8), length in 0.1f64..10.0) {
        let phi = Vector3::from(v);
        let q = quaternion(&exp(&phi));
        prop_assert!((matrix(&(q * length)) - exp(&phi)).norm() < 1e-14);
        prop_assert!((quaternion_log(&(q * -length)) - log(&exp(&phi))).norm() < 1e-14);
    }

    #[test]
    fn the_inverse_jacobian_is_the_inverse(v in prop::array::uniform3(-1.8f64..1.8)) {
        let phi = Vector3::from(v);
        let product = inverse_left_jacobian(&phi) * exp_with_jacobian(&phi).1;
        prop_assert!((product - Matrix3::identity()).norm() < 1e-13);
    }
}

#[test]
fn series_and_closed_form_agree() {
    let x = 0.999_999f64;
    let (angle, series) = (x.sqrt(), coefficients(x));
    assert!((series.a - angle.sin() / angle).abs() < 1e-15);
    assert!((series.b - (1.0 - angle.cos()) / x).abs() < 1e-15);
    assert!((series.c - (angle - angle.sin()) / (x * angle)).abs() < 1e-15);
    let (short, long) = (coefficients(0.019_999f64), series_coefficients::<f64, TERMS>(0.019_999));
    assert!((short.a - long.a).abs() + (short.b - long.b).abs() + (short.c - long.c).abs() < 1e-15);
    let inverse = |x: f64| inverse_left_jacobian(&Vector3::new(x, 0.0, 0.0)).m22;
    assert!((inverse(0.999_999_999_999) - inverse(1.0)).abs() < 1e-12);
}
