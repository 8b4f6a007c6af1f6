//! Directions on a sphere: two discs, each a half seen along z, of equal area.
//!
//! Lambert's azimuthal projection: r = √(2 − 2 |u_z|), so that equal parts of the sphere are equal on paper.

use std::collections::HashSet;

use maud::{Markup, html};
use nalgebra::Vector3;

use super::plot::{WIDTH, short};

const HEIGHT: f64 = 190.0;
const RADIUS: f64 = 72.0;
/// Directions nearer than this to one another are drawn once.
const CELL: f64 = 40.0;

/// The drawing of directions, which need not be of length one.
#[must_use]
pub fn sphere(directions: &[Vector3<f64>], label: &str) -> Markup {
    let mut seen = HashSet::new();
    let mut dots = Vec::new();
    for direction in directions {
        let Some(u) = direction.try_normalize(0.0).filter(|u| u.iter().all(|part| part.is_finite())) else {
            continue;
        };
        if seen.insert(u.map(|part| (part * CELL).round() as i64)) {
            dots.push(place(&u));
        }
    }
    html! {
        svg viewBox={ "0 0 " (WIDTH) " " (HEIGHT) } role="img" aria-label=(label) {
            @for (half, name) in ["+z towards you", "−z towards you"].into_iter().enumerate() {
                @let middle = middle(half == 0);
                circle class="frame" cx=(middle) cy="86" r=(RADIUS) {}
                circle class="grid" cx=(middle) cy="86" r=(short(RADIUS * (1.0 - 0.5f64.sqrt()).sqrt())) {}
                path class="grid" d={ "M" (middle - RADIUS) " 86h" (2.0 * RADIUS) "M" (middle) " " (86.0 - RADIUS) "v" (2.0 * RADIUS) } {}
                text class="name" x=(middle) y="184" text-anchor="middle" { (name) }
            }
            @for (x, y) in &dots { circle class="x" cx=(short(*x)) cy=(short(*y)) r="2" {} }
        }
    }
}

fn middle(upper: bool) -> f64 {
    if upper { 0.25 * WIDTH } else { 0.75 * WIDTH }
}

/// Where a direction is drawn: x to the right and y up on the upper half; the lower half is seen from below, mirrored in x.
fn place(u: &Vector3<f64>) -> (f64, f64) {
    let upper = u.z >= 0.0;
    let flat = u.x.hypot(u.y);
    // Equal area: at the rim √(2 − 2·0) = √2, which is the disc's radius.
    let radius = RADIUS * (1.0 - u.z.abs()).sqrt();
    let (x, y) = if flat > 0.0 { (u.x / flat, u.y / flat) } else { (0.0, 0.0) };
    let x = if upper { x } else { -x };
    (middle(upper) + radius * x, 86.0 - radius * y)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_poles_are_in_the_middles_and_the_equator_is_the_rim() {
        assert_eq!(place(&Vector3::z()), (0.25 * WIDTH, 86.0));
        assert_eq!(place(&-Vector3::z()), (0.75 * WIDTH, 86.0));
        assert_eq!(place(&Vector3::x()), (0.25 * WIDTH + RADIUS, 86.0));
    }

    #[test]
    fn equal_parts_of_the_sphere_are_equal_on_paper() {
        // A cap of height h has the area 2π h of the sphere's 4π, whatever its place.
        for height in [0.1, 0.5, 0.9] {
            let rim = Vector3::new((1.0f64 - (1.0 - height) * (1.0 - height)).sqrt(), 0.0, 1.0 - height);
            let radius = place(&rim).0 - 0.25 * WIDTH;
            assert!((radius * radius / (RADIUS * RADIUS) - height).abs() < 1e-12);
        }
    }

    #[test]
    fn many_directions_in_one_place_are_one_dot() {
        let many = vec![Vector3::x(); 10_000];
        assert_eq!(sphere(&many, "").into_string().matches("class=\"x\"").count(), 1);
    }
}
