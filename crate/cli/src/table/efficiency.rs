//! The paper's Table 6: what a picture and what a piece of a room cost.

use super::{
    grid::Grid,
    layout::{Kind, Table},
    method::Method,
};
use crate::failure::Failure;
use crate::size::Size;
use ::bench::{Subject, input::EDGE};
use burn::tensor::Device;
use pollster::block_on;
use serde_json::json;

/// The paper's pictures.
const SIZE: (u32, u32) = (640, 480);
const RUNS: usize = 9;

/// Milliseconds of every network's parts on `device`.
pub fn table(
    methods: &[Method],
    views: &[usize],
    size: Option<Size>,
    device: &Device,
    device_name: &str,
) -> Result<Table, Failure> {
    let size = size.map_or(SIZE, |size| size.0);
    let mut head = vec![
        "".to_owned(),
        "picture (ms)".to_owned(),
        "pictures/s".to_owned(),
    ];
    head.extend(
        views
            .iter()
            .map(|views| format!("1.6 m, {views} views (ms)")),
    );
    let mut found = Vec::new();
    let mut figures = Vec::new();
    for method in methods {
        let mut row = vec![method.name.clone()];
        if let Some(network) = method.as_network() {
            let subject = Subject {
                network,
                device,
                size,
                edge: EDGE,
                runs: RUNS,
            };
            let picture_ms = block_on(subject.picture())?.warm_ms;
            row.extend([
                format!("{picture_ms:.1}"),
                format!("{:.1}", 1e3 / picture_ms),
            ]);
            for &views in views {
                let piece_ms = block_on(subject.piece(views))?.whole.warm_ms;
                row.push(format!("{piece_ms:.1}"));
                figures.push(json!({
                        "method": method.name, "picture_ms": picture_ms, "views": views, "piece_ms": piece_ms,
                    }));
            }
        }
        found.push(row);
    }
    let head: Vec<&str> = head.iter().map(String::as_str).collect();
    let note = format!(
        "Medians of {RUNS} runs after two; results are read back in each. A picture of {}x{}: its feature planes (backbone, pyramid, PCE, ACM, IPSD), one at a \
         time. A piece of 1.6 m with everything occupied: back-projection, fusion of the views and the 3D networks of all three levels; {}; version {}, commit {}.",
        size.0,
        size.1,
        device_name,
        env!("CARGO_PKG_VERSION"),
        env!("IPDRECON_COMMIT"),
    );
    Ok(Table {
        kind: Kind::Efficiency.name(),
        grids: vec![Grid::new(&head, found)],
        notes: vec![note],
        cells: json!(figures),
    })
}
