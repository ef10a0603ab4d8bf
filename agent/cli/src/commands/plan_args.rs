//! Arguments of commands that plan views, to a [`PlanSpec`].

use super::numbers;
use clap::{Args, ValueEnum};
use semascan_inspection::spec::{PlanSpec, PlanStrategy};

/// How views are planned, as the command line says it; what is not said is as `cell.toml` or the default has it.
#[derive(Clone, Debug, Default, Args)]
pub(crate) struct PlanArgs {
    /// Choose where views are taken from, of a source that can be steered [default: as the source has them]
    #[arg(long, value_enum, value_name = "STRATEGY")]
    plan: Option<StrategyArg>,
    /// Most planned views of the whole surface [default: 12]
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u32).range(1..=1000))]
    views: Option<u32>,
    /// Least gain that is worth a view, as a share of the known surface [default: 0.01]
    #[arg(long, value_name = "SHARE", value_parser = numbers::share::<f64>, allow_negative_numbers = true)]
    least_gain: Option<f64>,
    /// After the whole surface look closely at the defects that were found
    #[arg(long)]
    refine: bool,
    /// Seed of everything random in the plan [default: 7]
    #[arg(long, value_name = "SEED")]
    plan_seed: Option<u64>,
}

/// How the next view is chosen.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
enum StrategyArg {
    /// By what it is expected to add to the model, less the way to it
    NextBest,
    /// By the number of frontier cells that it would see
    Greedy,
    /// Regular steps of the table
    Uniform,
    /// Anywhere within the limits of the cell
    Random,
}

impl PlanArgs {
    /// The specification `spec` with what the command line says.
    pub(crate) fn apply(&self, spec: &mut PlanSpec) {
        let strategy = self.plan.map(|strategy| match strategy {
            StrategyArg::NextBest => PlanStrategy::NextBest,
            StrategyArg::Greedy => PlanStrategy::Greedy,
            StrategyArg::Uniform => PlanStrategy::Uniform,
            StrategyArg::Random => PlanStrategy::Random,
        });
        spec.strategy = strategy.or(spec.strategy);
        spec.views = self.views.unwrap_or(spec.views);
        spec.least_gain = self.least_gain.unwrap_or(spec.least_gain);
        spec.refine |= self.refine;
        spec.seed = self.plan_seed.unwrap_or(spec.seed);
    }
}
