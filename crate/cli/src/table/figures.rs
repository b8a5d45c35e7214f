//! Figures of single meshes, and what they come to over many.

use mesh::metrics::{
    Depth2d, Surface3d, depth,
    robustness::{
        Deviation, coefficient_of_variation, max_drop, mean_performance_retention,
        performance_retention, stability_index,
    },
};
use serde::Serialize;

/// One mesh of a method, judged.
#[derive(Clone, Serialize)]
pub struct Cell {
    /// The set that the scan belongs to.
    pub set: String,
    /// The scan.
    pub scan: String,
    /// The row.
    pub method: String,
    /// The most views, of the scan or of a tile; `None` for all.
    pub views: Option<usize>,
    /// Seed of the choice of views.
    pub seed: u64,
    /// The figures, or why there are none.
    pub figures: Result<Figures, String>,
}

/// How good a mesh is.
#[derive(Clone, Serialize)]
pub struct Figures {
    /// In three dimensions.
    pub surface: Surface3d,
    /// What it shows to the scan's cameras; none where no frame shows any of it.
    pub depth: Option<Depth2d>,
    /// Keyframes used.
    pub keyframes: usize,
    /// Triangles.
    pub triangles: usize,
    /// Seconds that it took.
    pub seconds: f64,
}

/// Means over cells.
#[derive(Clone, Copy)]
pub struct Means {
    /// Accuracy, completeness, Chamfer distance in metres; precision, recall, F. A scan without a mesh counts as
    /// TransformerFusion counts it: distances 1 m, precision 1, recall and F 0.
    pub surface: [f64; 6],
    /// Over the meshes that show something.
    pub depth: Option<Depth2d>,
    /// Mean number of keyframes, of meshes that are there.
    pub keyframes: f64,
    /// Mean seconds, of meshes that are there.
    pub seconds: f64,
    /// Meshes, those that are missing too.
    pub cells: usize,
}

/// What a missing mesh counts.
const MISSING: [f64; 6] = [1.0, 1.0, 1.0, 1.0, 0.0, 0.0];

/// The means of some cells; `None` of none.
pub fn means<'a>(cells: impl Iterator<Item = &'a Cell>) -> Option<Means> {
    let cells: Vec<&Cell> = cells.collect();
    if cells.is_empty() {
        return None;
    }
    let made: Vec<&Figures> = cells
        .iter()
        .filter_map(|cell| cell.figures.as_ref().ok())
        .collect();
    let failed = cells.len() - made.len();
    let mut surface = MISSING.map(|value| value * failed as f64);
    for figures in &made {
        let of = &figures.surface;
        let values = [
            of.accuracy_m,
            of.completeness_m,
            of.chamfer_m,
            of.precision,
            of.recall,
            of.f_score,
        ];
        for (sum, value) in surface.iter_mut().zip(values) {
            *sum += value;
        }
    }
    let depths: Vec<Depth2d> = made.iter().filter_map(|figures| figures.depth).collect();
    let mean = |of: &dyn Fn(&Figures) -> f64| {
        made.iter().map(|figures| of(figures)).sum::<f64>() / made.len() as f64
    };
    Some(Means {
        surface: surface.map(|sum| sum / cells.len() as f64),
        depth: depth::mean(&depths),
        keyframes: mean(&|figures| figures.keyframes as f64),
        seconds: mean(&|figures| figures.seconds),
        cells: cells.len(),
    })
}

/// How steady a method is over numbers of views, by the paper's formulas; as fractions.
pub struct Steadiness {
    /// Coefficient of variation of F with the variance of a sample (n - 1), as the paper has it for others.
    pub cv_sample: f64,
    /// And of a population (n), as the paper has it for its own row.
    pub cv_population: f64,
    /// F with the fewest views over F with the most.
    pub retention_f: f64,
    /// The mean of that over precision, recall and F.
    pub retention: f64,
    /// How much less F is with the fewest views than with the most.
    pub max_drop: f64,
    /// The product over F, precision and recall of the least over the most.
    pub stability: f64,
}

/// From the means at each number of views, the fewest first.
pub fn steadiness(means: &[Means]) -> Option<Steadiness> {
    let column = |k: usize| -> Vec<f64> { means.iter().map(|means| means.surface[k]).collect() };
    let [precision, recall, f] = [3, 4, 5].map(column);
    let ends = |values: &[f64]| Some((*values.first()?, *values.last()?));
    let (few, many) = ends(&f)?;
    Some(Steadiness {
        cv_sample: coefficient_of_variation(&f, Deviation::Sample),
        cv_population: coefficient_of_variation(&f, Deviation::Population),
        retention_f: performance_retention(few, many),
        retention: mean_performance_retention(&[ends(&precision)?, ends(&recall)?, (few, many)]),
        max_drop: max_drop(few, many),
        stability: stability_index(&[&f, &precision, &recall]),
    })
}
