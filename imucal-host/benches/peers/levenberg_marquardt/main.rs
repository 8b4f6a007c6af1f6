//! Seconds that the crate `levenberg-marquardt` takes to fit gain and bias of points near a sphere, by derivatives written out; the
//! quickest of so many times.
//!
//! `peer-levenberg-marquardt POINTS.csv LENGTH REPEATS`

use std::{env, error::Error, fs, hint::black_box, time::Instant};

use levenberg_marquardt::{LeastSquaresProblem, LevenbergMarquardt};
use nalgebra::{Dyn, Matrix3, OMatrix, Owned, SVector, U1, U9, VecStorage, Vector, Vector3};

type Parameters = SVector<f64, 9>;

/// Points, and where the fit is: a gain's upper triangle by rows, then the bias.
struct Shell<'a> {
    points: &'a [Vector3<f64>],
    length: f64,
    at: Parameters,
}

impl Shell<'_> {
    fn gain(&self) -> Matrix3<f64> {
        let p = &self.at;
        Matrix3::new(p[0], p[1], p[2], 0.0, p[3], p[4], 0.0, 0.0, p[5])
    }

    fn bias(&self) -> Vector3<f64> {
        self.at.fixed_rows::<3>(6).into()
    }
}

impl LeastSquaresProblem<f64, Dyn, U9> for Shell<'_> {
    type ResidualStorage = VecStorage<f64, Dyn, U1>;
    type JacobianStorage = Owned<f64, Dyn, U9>;
    type ParameterStorage = Owned<f64, U9>;

    fn set_params(&mut self, at: &Parameters) {
        self.at = *at;
    }

    fn params(&self) -> Parameters {
        self.at
    }

    fn residuals(&self) -> Option<Vector<f64, Dyn, Self::ResidualStorage>> {
        let (gain, bias) = (self.gain(), self.bias());
        let each = self.points.iter().map(|x| (gain * (x - bias)).norm() - self.length);
        Some(Vector::<f64, Dyn, Self::ResidualStorage>::from_iterator(self.points.len(), each))
    }

    fn jacobian(&self) -> Option<OMatrix<f64, Dyn, U9>> {
        let (gain, bias) = (self.gain(), self.bias());
        let mut jacobian = OMatrix::<f64, Dyn, U9>::zeros(self.points.len());
        for (row, x) in self.points.iter().enumerate() {
            let x = x - bias;
            let u = (gain * x).normalize();
            let by_bias = -gain.tr_mul(&u);
            let by = [
                u.x * x.x,
                u.x * x.y,
                u.x * x.z,
                u.y * x.y,
                u.y * x.z,
                u.z * x.z,
                by_bias.x,
                by_bias.y,
                by_bias.z,
            ];
            by.iter().enumerate().for_each(|(k, value)| jacobian[(row, k)] = *value);
        }
        Some(jacobian)
    }
}

fn main() -> Result<(), Box<dyn Error>> {
    let arguments: Vec<String> = env::args().skip(1).collect();
    let [path, length, repeats] = &arguments[..] else { return Err("POINTS.csv LENGTH REPEATS".into()) };
    let point = |line: &str| {
        let values: Result<Vec<f64>, _> = line.split(',').map(str::parse).collect();
        values.map(|values| Vector3::from_column_slice(&values))
    };
    let points: Vec<Vector3<f64>> = fs::read_to_string(path)?.lines().map(point).collect::<Result<_, _>>()?;
    let start = Parameters::from_column_slice(&[1.0, 0.0, 0.0, 1.0, 0.0, 1.0, 0.0, 0.0, 0.0]);
    let length: f64 = length.parse()?;
    let mut least = f64::INFINITY;
    for _ in 0..repeats.parse::<usize>()? {
        let begun = Instant::now();
        let problem = Shell { points: black_box(&points), length, at: start };
        let (_, report) = black_box(LevenbergMarquardt::new().minimize(problem));
        least = least.min(begun.elapsed().as_secs_f64());
        if !report.termination.was_successful() {
            return Err(format!("{report:?}").into());
        }
    }
    println!("{least}");
    Ok(())
}
