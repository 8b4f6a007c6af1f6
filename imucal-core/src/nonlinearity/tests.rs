use super::*;
use proptest::array::uniform3;
use proptest::prelude::*;

/// Terms of any make-up whose slope over ±`range` is `slope`.
fn nonlinearity(slope: f64) -> impl Strategy<Value = Nonlinearity<f64>> {
    let unit = || uniform3(-1f64..1.0);
    (unit(), unit(), uniform3(unit()), -3f64..5.0, any::<bool>()).prop_map(
        move |(quadratic, cubic, cross, decade, crossed)| {
            let range = 10f64.powf(decade);
            let cross = if crossed { cross.map(|row| row.map(|x| x / range)) } else { [[0.0; 3]; 3] };
            let terms = NonlinearTerms {
                quadratic: quadratic.map(|x| x / range),
                cubic: cubic.map(|x| x / (range * range)),
                cross,
            };
            let size = slope / terms.slope(range);
            let scaled = |x: f64| size * x;
            let terms = NonlinearTerms {
                quadratic: terms.quadratic.map(scaled),
                cubic: terms.cubic.map(scaled),
                cross: terms.cross.map(|row| row.map(scaled)),
            };
            Nonlinearity { terms, range }
        },
    )
}

/// The largest component: the norm that the bound is in.
fn largest(x: &Vector3<f64>) -> f64 {
    x.amax()
}

proptest! {
    #[test]
    fn what_is_put_out_is_undone_to_the_tolerance_within_the_range_and_far_beyond(
        n in (0.0f64..=STEEPEST).prop_flat_map(nonlinearity), x in uniform3(-3f64..3.0),
    ) {
        let linearizer = Linearizer::new(n).unwrap();
        let x = Vector3::from(x) * n.range;
        let missed = largest(&(linearizer.sense(&n.respond(&x)) - x));
        prop_assert!(missed <= (TOLERANCE + 1e-14) * n.range, "{missed:e} of {:e}, {linearizer:?}", n.range);
    }

    #[test]
    fn in_single_precision_roundings_alone_come_on_top(
        n in (0.0f64..=STEEPEST).prop_flat_map(nonlinearity), x in uniform3(-3f64..3.0),
    ) {
        let narrow = Nonlinearity { terms: n.terms.cast::<f32>(), range: n.range as f32 };
        let linearizer = Linearizer::new(narrow).unwrap();
        let x = (Vector3::from(x) * n.range).cast::<f32>();
        let missed = (linearizer.sense(&narrow.respond(&x)) - x).amax();
        // Output, excess and difference: half a last place each of what is at most four ranges.
        prop_assert!(missed <= 8.0 * f32::EPSILON * narrow.range, "{missed:e} of {:e}", narrow.range);
    }

    /// By differences along random chords, and not by the derivative that the bound is made of.
    #[test]
    fn no_chord_is_steeper_than_the_slope(
        n in (0.0f64..=STEEPEST).prop_flat_map(nonlinearity), a in uniform3(-2f64..2.0), b in uniform3(-2f64..2.0),
    ) {
        let (a, b) = (Vector3::from(a) * n.range, Vector3::from(b) * n.range);
        let rise = largest(&(n.excess(&a) - n.excess(&b)));
        prop_assert!(rise <= n.terms.slope(n.range) * largest(&(a - b)) * (1.0 + 1e-12));
    }

    #[test]
    fn the_first_error_is_half_a_slope_of_the_range_at_the_most(
        n in (0.0f64..=STEEPEST).prop_flat_map(nonlinearity), x in uniform3(-2f64..2.0),
    ) {
        let most = 0.5 * n.terms.slope(n.range) * n.range;
        prop_assert!(largest(&n.excess(&(Vector3::from(x) * n.range))) <= most * (1.0 + 1e-12));
    }

    #[test]
    fn steeper_terms_are_refused_with_their_slope(n in (0.101f64..10.0).prop_flat_map(nonlinearity)) {
        let refused = Linearizer::new(n).unwrap_err();
        let slope = n.terms.slope(n.range);
        prop_assert!((f64::from(refused.slope) / slope - 1.0).abs() < 1e-6);
    }

    #[test]
    fn products_that_are_zero_change_no_result(n in nonlinearity(0.05), x in uniform3(-2f64..2.0)) {
        let terms = NonlinearTerms { cross: [[0.0; 3]; 3], ..n.terms };
        let axial = Linearizer::new(Nonlinearity { terms, ..n }).unwrap();
        let crossed = Linearizer { crossed: true, ..axial };
        let output = Vector3::from(x) * n.range;
        prop_assert_eq!(axial.sense(&output), crossed.sense(&output));
    }
}

#[test]
fn each_term_has_its_own_axis_and_power() {
    let terms = NonlinearTerms {
        quadratic: [0.5, 0.0, 0.0],
        cubic: [0.0, 0.25, 0.0],
        cross: [[0.0; 3], [1.0, 0.0, 0.0], [0.0, 2.0, 4.0]],
    };
    let n = Nonlinearity { terms, range: f64::INFINITY };
    let x = Vector3::new(2.0, -3.0, 5.0);
    assert_eq!(n.excess(&x), Vector3::new(0.5 * 4.0, 0.25 * -27.0 - 6.0, 2.0 * -15.0 + 4.0 * 10.0));
    assert_eq!(n.respond(&x), x + n.excess(&x));
    // Held to 2 beyond it: (2, -2, 2).
    let held = Nonlinearity { range: 2.0, ..n };
    assert_eq!(held.excess(&x), Vector3::new(2.0, 0.25 * -8.0 - 4.0, 2.0 * -4.0 + 4.0 * 4.0));
}

#[test]
fn rounds_follow_the_slope() {
    let of = |slope: f64| {
        let terms = NonlinearTerms { quadratic: [0.0, 0.5 * slope / 8.0, 0.0], ..NonlinearTerms::none() };
        Linearizer::new(Nonlinearity { terms, range: 8.0 }).unwrap().rounds()
    };
    assert_eq!([0.0, 1e-7, 1e-4, 1e-3, 1e-2, 0.1].map(of), [0, 0, 1, 2, 3, 6]);
}

#[test]
fn terms_or_a_range_that_are_no_numbers_are_refused() {
    for (coefficient, range) in [(f32::NAN, 1.0), (1.0, f32::NAN), (0.0, f32::INFINITY), (f32::INFINITY, 1.0)]
    {
        for at in 0..3 {
            let mut terms = NonlinearTerms::none();
            terms.quadratic[at] = coefficient;
            assert!(Linearizer::new(Nonlinearity { terms, range }).is_err(), "{coefficient} {range}");
        }
    }
}
