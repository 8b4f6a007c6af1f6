//! Poses in a frame whose z points up, as ROS has them (REP 103): to the frame n, whose z points down.
//!
//! ```text
//! p_n = (p_y, p_x, −p_z)      q_n = (0, √½, √½, 0) ⊗ q
//! ```
//!
//! East, north, up become north, east, down; of a frame whose x is not east, n is as level, and its x is that frame's y.

/// Columns of positions, m.
pub(crate) fn positions(columns: &[Vec<f64>]) -> Vec<Vec<f64>> {
    turned(columns, position)
}

/// Columns of attitudes body → frame, scalar first.
pub(crate) fn attitudes(columns: &[Vec<f64>]) -> Vec<Vec<f64>> {
    turned(columns, attitude)
}

fn turned<const N: usize>(columns: &[Vec<f64>], turn: fn([f64; N]) -> [f64; N]) -> Vec<Vec<f64>> {
    let rows = columns.first().map_or(0, Vec::len);
    let mut made = vec![Vec::with_capacity(rows); N];
    let of_row = |row: usize| turn(std::array::from_fn(|at| columns[at][row]));
    for values in (0..rows).map(of_row) {
        made.iter_mut().zip(values).for_each(|(column, value)| column.push(value));
    }
    made
}

fn position([x, y, z]: [f64; 3]) -> [f64; 3] {
    [y, x, -z]
}

fn attitude([w, x, y, z]: [f64; 4]) -> [f64; 4] {
    let half = std::f64::consts::FRAC_1_SQRT_2;
    [-half * (x + y), half * (w + z), half * (w - z), half * (y - x)]
}

#[cfg(test)]
mod tests {
    use nalgebra::{Quaternion, UnitQuaternion, Vector3};

    use super::*;

    #[test]
    fn a_vector_of_the_body_is_turned_as_a_position_is() {
        let q = UnitQuaternion::from_euler_angles(0.3, -0.7, 2.1);
        let turned = attitude([q.w, q.i, q.j, q.k]);
        let turned =
            UnitQuaternion::from_quaternion(Quaternion::new(turned[0], turned[1], turned[2], turned[3]));
        let body = Vector3::new(0.2, -1.5, 0.6);
        let expected = Vector3::from(position((q * body).into()));
        assert!((turned * body - expected).norm() < 1e-15, "{}", turned * body);
    }

    #[test]
    fn east_north_up_become_north_east_down() {
        assert_eq!(position([1.0, 2.0, 3.0]), [2.0, 1.0, -3.0]);
    }
}
