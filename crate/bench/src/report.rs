//! All parts of a network on a device, as a table and as data.

use burn::tensor::Device;
use net::Ipdrecon;
use serde::Serialize;
use std::ops::Add;

use crate::peak::Peak;
use crate::subject::{STAGES, Subject, Unread};
use crate::time::Times;
use crate::work::{self, Work};

/// A piece that takes longer is the last: with more views it would take many minutes.
const TOO_LONG_MS: f64 = 30_000.0;

/// What to measure.
#[derive(Clone, Debug)]
pub struct Asked {
    /// Width and height of pictures.
    pub sizes: Vec<(u32, u32)>,
    /// Numbers of views of a piece.
    pub views: Vec<usize>,
    /// Pictures' size for the pieces.
    pub piece_size: (u32, u32),
    /// Fine voxels along the edge of a piece.
    pub edge: i32,
    /// Warm runs.
    pub runs: usize,
}

/// A part.
#[derive(Clone, Debug, Serialize)]
pub struct Row {
    /// What was measured.
    pub part: String,
    /// Milliseconds of the first run; none for a stage, which others have warmed.
    pub cold_ms: Option<f64>,
    /// Median of the warm runs.
    pub warm_ms: f64,
    /// What it had to compute and move; none where nothing is counted.
    pub work: Option<Work>,
}

impl Row {
    fn of(part: String, times: Times, work: Work) -> Self {
        Self {
            part,
            cold_ms: Some(times.cold_ms),
            warm_ms: times.warm_ms,
            work: Some(work),
        }
    }
}

/// All that was measured.
#[derive(Clone, Debug, Serialize)]
pub struct Report {
    /// What the device can do.
    pub peak: Peak,
    /// Its parts.
    pub rows: Vec<Row>,
    /// Views of pieces that were not measured, because one of fewer views took more than half a minute.
    pub left_out: Vec<usize>,
}

impl Report {
    /// Measures the parts of `network` one after the other.
    ///
    /// # Errors
    /// A device that gives nothing back.
    pub async fn measure(
        network: &Ipdrecon,
        device: &Device,
        asked: &Asked,
    ) -> Result<Self, Unread> {
        let config = network.config();
        let peak = Peak::measure(device).await?;
        let subject = |size| Subject {
            network,
            device,
            size,
            edge: asked.edge,
            runs: asked.runs,
        };
        let mut rows = Vec::new();
        for &size in &asked.sizes {
            let subject = subject(size);
            let words = format!("picture of {}x{}", size.0, size.1);
            let times = subject.pyramid().await?;
            let part = format!("{words}: backbone and pyramid");
            rows.push(Row::of(part, times, work::pyramid(config, size)));
            let times = subject.picture().await?;
            let part = format!("{words}: all planes");
            rows.push(Row::of(part, times, work::picture(config, size)));
        }
        let mut left_out = Vec::new();
        let mut slow = false;
        for &views in &asked.views {
            if slow {
                left_out.push(views);
                continue;
            }
            let piece = subject(asked.piece_size).piece(views).await?;
            slow = piece.whole.cold_ms.max(piece.whole.warm_ms) > TOO_LONG_MS;
            let all = piece.stages.into_iter().fold(Work::default(), Work::add);
            let millions = piece.pairs as f64 / 1e6;
            let part = format!("piece, {views} views ({millions:.2} million pairs)");
            rows.push(Row::of(part, piece.whole, all));
            let stages = STAGES.iter().zip(piece.stages_ms).zip(piece.stages);
            rows.extend(stages.map(|((stage, warm_ms), work)| Row {
                part: format!("piece, {views} views: {stage}"),
                cold_ms: None,
                warm_ms,
                work: (work != Work::default()).then_some(work),
            }));
        }
        Ok(Self {
            peak,
            rows,
            left_out,
        })
    }

    /// As Markdown.
    pub fn markdown(&self) -> String {
        let mut lines = vec![
            "| part | cold ms | warm ms | GFLOP/s | of peak | GB/s | of peak |".to_owned(),
            "|---|---|---|---|---|---|---|".to_owned(),
        ];
        lines.extend(self.rows.iter().map(|row| self.line(row)));
        lines.push(String::new());
        lines.push(format!(
            "Peak: {:.1} GFLOP/s, {:.1} GB/s.",
            self.peak.flops / 1e9,
            self.peak.bytes / 1e9
        ));
        if !self.left_out.is_empty() {
            lines.push(format!(
                "\nNot measured: pieces of {:?} views, for one of fewer took more than half a minute.",
                self.left_out
            ));
        }
        lines.join("\n")
    }

    fn line(&self, row: &Row) -> String {
        let dash = || "–".to_owned();
        let cold = row.cold_ms.map_or_else(dash, |ms| format!("{ms:.1}"));
        let work = row.work.map_or_else(
            || "– | – | – | –".to_owned(),
            |work| {
                let [flops, bytes] = self.peak.shares(work, row.warm_ms);
                format!(
                    "{:.1} | {:.0} % | {:.1} | {:.0} %",
                    work.flops / row.warm_ms / 1e6,
                    100.0 * flops,
                    work.bytes / row.warm_ms / 1e6,
                    100.0 * bytes
                )
            },
        );
        format!("| {} | {cold} | {:.1} | {work} |", row.part, row.warm_ms)
    }
}
