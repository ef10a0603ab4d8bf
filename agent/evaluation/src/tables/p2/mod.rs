//! [Wang 2023], Tables 2 to 4, on the virtual cell: two streams with a contribution layer against one stream, other
//! channels and other networks.
//!
//! The paper trains and measures on pictures of rooms (walls, curtains ...); here it is five components of starter
//! motors. The tables are ours to read against each other; the paper's stand beside them to show what it compared.

mod published;

pub use published::Published;

use super::setting::{Judged, NOT_TRAINED, images_seen, pictures, score_singles};
use super::{DomainScores, NetworkSetting, Progress};
use crate::{NetworkError, PixelScores, TestDomain};
use published::{TABLE_2, TABLE_3, TABLE_4};
use serde::Serialize;
use std::io::{self, Write};

/// The tables there are.
pub const TABLES: [u32; 3] = [2, 3, 4];

/// A table: its number, its name, and the models in it with what they are here.
type Listed = (u32, &'static str, &'static [(&'static str, &'static str)]);

/// The tables' rows.
const ROWS: [Listed; 3] = [
    (2, "Table 2: final figures", &[("two-stream-edge", "two streams, contribution")]),
    (
        3,
        "Table 3: channels",
        &[
            ("u-net-edge", "U-Net, colour"),
            ("u-net-edge-depth", "U-Net, depth"),
            ("ud-net-edge-early", "U-Net, colour and depth stacked"),
            ("two-stream-edge", "two streams, contribution"),
        ],
    ),
    (
        4,
        "Table 4: networks",
        &[
            ("fcn-edge", "FCN, colour and depth stacked"),
            ("two-stream-fcn-edge", "FCN, two streams"),
            ("ud-net-edge-early", "plain U-Net, stacked"),
            ("two-stream-edge", "U-Net, two streams, contribution"),
        ],
    ),
];

/// What is run.
#[derive(Clone, Debug)]
pub struct Config {
    /// Of [`TABLES`].
    pub tables: Vec<u32>,
    /// Views and models.
    pub networks: NetworkSetting,
}

/// One network.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Row {
    /// Its model.
    pub model: String,
    /// What it is.
    pub network: String,
    /// Pictures that it was trained on, repeats counted, where its manifest says so.
    pub images_seen: Option<i64>,
    /// Ours by domain; empty: not trained here.
    pub domains: Vec<DomainScores>,
}

/// One table.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Table {
    /// Its number in the paper.
    pub number: u32,
    /// What it shows.
    pub title: String,
    /// Ours.
    pub rows: Vec<Row>,
    /// The paper's.
    pub published: Vec<Published>,
}

/// The tables.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct P2Tables {
    /// How the figures are to be read.
    pub setting: String,
    /// Those that were asked for.
    pub tables: Vec<Table>,
}

/// Makes the tables; `on_step` gets how many steps are done, and of how many.
///
/// # Errors
/// [`NetworkError`] if a network that is there cannot be used.
pub fn run(config: &Config, mut on_step: impl FnMut(usize, usize)) -> Result<P2Tables, NetworkError> {
    let setting = &config.networks;
    let wanted = ROWS.iter().filter(|(number, _, _)| config.tables.contains(number));
    let mut names: Vec<&str> = wanted.clone().flat_map(|(_, _, rows)| rows.iter().map(|(model, _)| *model)).collect();
    names.sort_unstable();
    names.dedup();
    let mut progress = Progress::new(&mut on_step);
    progress.expect(TestDomain::ALL.len() * setting.test.count());
    let scored = score_singles(&names, setting, &mut progress)?;
    let judged = |model: &str| -> Option<&Judged> { scored[names.iter().position(|name| *name == model)?].as_ref() };
    let table = |(number, title, rows): &(u32, &str, &[(&str, &str)])| Table {
        number: *number,
        title: (*title).to_owned(),
        rows: rows
            .iter()
            .map(|(model, network)| Row {
                model: (*model).to_owned(),
                network: (*network).to_owned(),
                images_seen: judged(model).and_then(|(manifest, _)| images_seen(manifest)),
                domains: judged(model).map_or_else(Vec::new, |(_, domains)| domains.clone()),
            })
            .collect(),
        published: match number {
            2 => TABLE_2.to_vec(),
            3 => TABLE_3.to_vec(),
            _ => TABLE_4.to_vec(),
        },
    };
    let test = &setting.test;
    let text = format!(
        "ours: virtual cell, {} motors that nothing was trained on, {} views each, compact backbones, one network asked once, \
         six classes (none and five components); Acc = correct pixels, ave_acc = mean over classes of correct / true, mean \
         IoU over all classes, precision and recall without none. Published: rooms, other classes and networks: \
         not comparable",
        test.motors.len(),
        test.views
    );
    Ok(P2Tables { setting: text, tables: wanted.map(table).collect() })
}

/// Writes the tables for people.
///
/// # Errors
/// If `out` fails.
pub fn print(out: &mut dyn Write, report: &P2Tables) -> io::Result<()> {
    for table in &report.tables {
        write!(out, "P2 on the virtual cell, {:<26}{:<14}", table.title, "%")?;
        for column in ["Acc", "ave_acc", "mean IoU", "precision", "recall"] {
            write!(out, "{column:>11}")?;
        }
        writeln!(out)?;
        for row in &table.rows {
            if row.domains.is_empty() {
                writeln!(out, "{:<50}{NOT_TRAINED}", row.network)?;
            }
            for DomainScores { domain, scores } in &row.domains {
                let network = format!("{} ({} pictures)", row.network, pictures(row.images_seen));
                line(out, &network, domain.name(), figures(scores))?;
            }
        }
        for p in &table.published {
            line(out, &format!("P2: {}", p.network), "", p.figures)?;
        }
        writeln!(out)?;
    }
    writeln!(out, "{}", report.setting)
}

/// The paper's five figures in per cent.
fn figures(s: &PixelScores) -> [f64; 5] {
    [s.pixel_accuracy, s.mean_accuracy, s.mean_iou_with_none, s.mean_precision_without_none, s.mean_recall_without_none]
        .map(|share| share * 100.0)
}

fn line(out: &mut dyn Write, network: &str, domain: &str, figures: [f64; 5]) -> io::Result<()> {
    write!(out, "{network:<50}{domain:<14}")?;
    figures.iter().try_for_each(|f| write!(out, "{f:>11.2}"))?;
    writeln!(out)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::network_fixtures::{manifest, onnx, write};

    #[test]
    fn what_is_there_is_judged_and_the_rest_is_said_not_to_be() {
        let root = tempfile::tempdir().expect("a folder");
        let dark = onnx::classifier(&[&[0.0; 3], &[-9.0; 3]], &[0.0, 5.0]);
        write(&root.path().join("comparison/u-net-edge"), manifest("semantic", &["none", "housing"]), &[dark]);
        let networks = NetworkSetting { models: Some(root.path().to_owned()), ..NetworkSetting::quick() };
        let mut last_step = (0, 0);
        let report =
            run(&Config { tables: vec![3, 4], networks }, |done, all| last_step = (done, all)).expect("tables");
        assert_eq!(last_step, (6, 6));
        assert_eq!(report.tables.iter().map(|t| t.number).collect::<Vec<_>>(), [3, 4]);
        let [there, gone, ..] = &report.tables[0].rows[..] else { panic!("rows") };
        assert_eq!((there.domains.len(), gone.domains.len()), (3, 0));
        let mut text = Vec::new();
        print(&mut text, &report).expect("printed");
        let text = String::from_utf8(text).expect("UTF-8");
        for word in ["not trained here", "U-Net, colour", "shifted", "47.80", "not comparable"] {
            assert!(text.contains(word), "{word}: {text}");
        }
    }
}
