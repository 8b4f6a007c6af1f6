//! Kinematics of a three-gimbal rig: exact attitude, rate and angular acceleration of the table.
//!
//! The rig is a chain of turns, each about an axis fixed in the frame before it:
//!
//! ```text
//! C_t_n = R_z(ψ) R_y(β) R_x(α) · R_u R_v · R_outer · R_skew · R_middle · R_skew · R_inner
//! w' = Rᵀ w + e θ̇      ẇ' = Rᵀ ẇ + e θ̈ + (Rᵀ w) × e θ̇
//! ```
//!
//! | symbol | meaning |
//! | --- | --- |
//! | ψ, α, β | heading and levelling tilts of the base; behind them stands p |
//! | u, v | wobble of the outer axis, about the two axes that follow it cyclically |
//! | e, θ | axis and angle of a turn; w, ẇ before it, w', ẇ' behind it, each in its own frame |
//!
//! With an exact rig C_t_p = R_axes\[0\](α) R_axes\[1\](β) R_axes\[2\](γ), as recordings have it. Not modelled: axes
//! that miss each other, bending under load.

use imucal_core::rotation;
use nalgebra::{Matrix3, Vector3};

use crate::{
    effect::{Machine, Swing},
    recording::manifest::Axis,
};

/// Attitude and motion of the table against its base at an instant.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Pose {
    /// Table to base.
    pub c_t_p: Matrix3<f64>,
    /// Table to outer gimbal.
    pub c_t_o: Matrix3<f64>,
    /// Table to middle gimbal.
    pub c_t_m: Matrix3<f64>,
    /// Rate of the table against the base, rad/s.
    pub w_pt_t: Vector3<f64>,
    /// Its derivative in the table, rad/s².
    pub dw_pt_t: Vector3<f64>,
}

/// The direction of an axis.
pub fn direction(axis: Axis) -> Vector3<f64> {
    match axis {
        Axis::X => Vector3::x(),
        Axis::Y => Vector3::y(),
        Axis::Z => Vector3::z(),
    }
}

/// Motion of a frame at the end of the chain so far.
struct Chain {
    c: Matrix3<f64>,
    w: Vector3<f64>,
    dw: Vector3<f64>,
}

impl Chain {
    fn base() -> Self {
        Self { c: Matrix3::identity(), w: Vector3::zeros(), dw: Vector3::zeros() }
    }

    fn turn(&mut self, axis: &Vector3<f64>, swing: Swing) {
        let r = rotation::exp(&(axis * swing.angle));
        let (w, rate) = (r.tr_mul(&self.w), axis * swing.rate);
        self.dw = r.tr_mul(&self.dw) + axis * swing.acceleration + w.cross(&rate);
        self.w = w + rate;
        self.c *= r;
    }
}

/// C_p_n of a rig's base.
pub fn base(heading: f64, [tilt_x, tilt_y]: [f64; 2]) -> Matrix3<f64> {
    let turn = |axis: Vector3<f64>, angle: f64| rotation::exp(&(axis * angle));
    turn(Vector3::z(), heading) * turn(Vector3::y(), tilt_y) * turn(Vector3::x(), tilt_x)
}

/// The pose of a rig's table.
pub fn pose(machine: &Machine) -> Pose {
    let [outer, middle, inner] = &machine.axes;
    let mut chain = Chain::base();
    // A level rig without wobble keeps the plain product of three rotations, bit for bit.
    for (axis, wobble) in [cyclic(outer), cyclic(&cyclic(outer))].iter().zip(machine.wobble) {
        if wobble != Swing::default() {
            chain.turn(axis, wobble);
        }
    }
    chain.turn(outer, machine.gimbals[0]);
    let c_o_p = chain.c;
    skew(&mut chain, outer, middle, machine.skew[0]);
    chain.turn(middle, machine.gimbals[1]);
    let c_m_p = chain.c;
    skew(&mut chain, middle, inner, machine.skew[1]);
    chain.turn(inner, machine.gimbals[2]);
    Pose {
        c_t_p: chain.c,
        c_t_o: c_o_p.tr_mul(&chain.c),
        c_t_m: c_m_p.tr_mul(&chain.c),
        w_pt_t: chain.w,
        dw_pt_t: chain.dw,
    }
}

/// The next axis: y of x, z of y, x of z.
fn cyclic(v: &Vector3<f64>) -> Vector3<f64> {
    Vector3::new(v.z, v.x, v.y)
}

fn skew(chain: &mut Chain, before: &Vector3<f64>, after: &Vector3<f64>, angle: f64) {
    if angle != 0.0 {
        chain.turn(&before.cross(after), Swing::still(angle));
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const AXES: [[Axis; 3]; 4] = [
        [Axis::Z, Axis::Y, Axis::X],
        [Axis::Z, Axis::X, Axis::Y],
        [Axis::X, Axis::Y, Axis::Z],
        [Axis::Y, Axis::Z, Axis::Y],
    ];

    /// A bad rig in full motion.
    fn machine(axes: [Axis; 3], t: f64) -> Machine {
        let swing = |a: f64, b: f64, c: f64| Swing {
            angle: a + b * t + c * t * t,
            rate: b + 2.0 * c * t,
            acceleration: 2.0 * c,
        };
        Machine {
            heading: 0.4,
            tilt: [0.02, -0.03],
            wobble: [swing(0.01, 0.02, 0.03), swing(-0.02, 0.01, 0.04)],
            gimbals: [swing(0.5, 1.1, -0.3), swing(-1.2, 0.7, 0.5), swing(2.2, -1.4, 0.2)],
            skew: [0.05, -0.04],
            ..Machine::exact(axes.map(direction))
        }
    }

    #[test]
    fn the_rate_is_the_derivative_of_the_attitude_for_any_order_of_axes() {
        let h = 1e-5;
        for axes in AXES {
            let at = |t: f64| pose(&machine(axes, t));
            for k in 0..20 {
                let t = 0.1 * f64::from(k);
                let (before, here, after) = (at(t - h), at(t), at(t + h));
                let turned = here.c_t_p.tr_mul(&((after.c_t_p - before.c_t_p) / (2.0 * h)));
                assert!((turned - rotation::cross_matrix(&here.w_pt_t)).norm() < 1e-8, "{axes:?} {t}");
                let dw = (after.w_pt_t - before.w_pt_t) / (2.0 * h);
                assert!((dw - here.dw_pt_t).norm() < 1e-8, "{axes:?} {t}");
            }
        }
    }

    #[test]
    fn the_attitude_is_the_contract_s_product_of_three_rotations() {
        for axes in AXES {
            let mut machine = Machine::exact(axes.map(direction));
            machine.gimbals = [0.7, -2.1, 1.3].map(Swing::still);
            let r = |k: usize| {
                *nalgebra::Rotation3::from_axis_angle(
                    &nalgebra::Unit::new_normalize(direction(axes[k])),
                    machine.gimbals[k].angle,
                )
                .matrix()
            };
            assert!((pose(&machine).c_t_p - r(0) * r(1) * r(2)).norm() < 1e-14, "{axes:?}");
        }
    }

    #[test]
    fn gravity_in_a_tilted_base_is_that_of_the_model() {
        let (alpha, beta) = (0.03f64, -0.05f64);
        let f_p = base(1.0, [alpha, beta]).tr_mul(&Vector3::new(0.0, 0.0, -1.0));
        let model = Vector3::new(beta.sin(), -beta.cos() * alpha.sin(), -beta.cos() * alpha.cos());
        assert!((f_p - model).norm() < 1e-15);
    }
}
