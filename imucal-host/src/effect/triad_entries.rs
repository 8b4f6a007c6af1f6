//! Entries of a triad that an effect's parameters change: a calibration's standard errors of them bound what the effect can
//! show against it.

use nalgebra::{Matrix3, Vector3};

/// Which entries, in the order of the effect's parameters.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum TriadEntries {
    /// x, y, z of the bias.
    Bias,
    /// The diagonal of the gain.
    Diagonal,
    /// The others by rows.
    OffDiagonal,
    /// The diagonal, then xy, xz, yz.
    Symmetric,
}

impl TriadEntries {
    /// Standard errors of these entries, given those of gain and bias. One of a pair off the diagonal may be held by the
    /// form of the calibration: then the other has the error of both.
    pub fn errors(self, gain: &Matrix3<f64>, bias: &Vector3<f64>) -> Vec<f64> {
        let pair = |(row, column)| gain[(row, column)].max(gain[(column, row)]);
        match self {
            Self::Bias => bias.iter().copied().collect(),
            Self::Diagonal => gain.diagonal().iter().copied().collect(),
            Self::OffDiagonal => [(0, 1), (0, 2), (1, 0), (1, 2), (2, 0), (2, 1)].map(pair).to_vec(),
            Self::Symmetric => [(0, 0), (1, 1), (2, 2), (0, 1), (0, 2), (1, 2)].map(pair).to_vec(),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::effect::CATALOGUE;

    #[test]
    fn each_parameter_has_an_entry() {
        let of_all = CATALOGUE.iter().filter_map(|effect| Some((effect, effect.changes?)));
        let counts: Vec<(usize, usize)> = of_all
            .map(|(effect, entries)| {
                (effect.parameters.len(), entries.errors(&Matrix3::identity(), &Vector3::x()).len())
            })
            .collect();
        assert_eq!(counts.len(), 11);
        assert!(counts.iter().all(|(parameters, entries)| parameters == entries), "{counts:?}");
    }

    #[test]
    fn of_a_pair_the_larger_error_counts() {
        let gain = Matrix3::new(1.0, 2.0, 0.0, 0.0, 3.0, 0.0, 5.0, 0.0, 4.0);
        let errors = TriadEntries::OffDiagonal.errors(&gain, &Vector3::zeros());
        assert_eq!(errors, [2.0, 5.0, 2.0, 0.0, 5.0, 0.0]);
    }
}
