//! The loop: samples, gradients, steps; now and then a look at the held-out scans, and a checkpoint.

mod numbers;
mod validation;

use crate::adam::{self, Adam};
use crate::checkpoint::{Checkpoint, RunState};
use crate::config::TrainConfig;
use crate::cost;
use crate::data::{Augment, SampleOptions, Sampler, ScanSet};
use crate::error::TrainError;
use crate::feed::Feed;
use crate::log::{self, Log};
use crate::plot;
use crate::task::{Descent, Moment, Task};
use burn::module::{Flag, Module, ModuleMapper, Param};
use burn::optim::{GradientsAccumulator, GradientsParams};
use burn::tensor::Device;
use net::sample::Sample;
use numbers::Numbers;
use serde_json::Value;
use std::sync::Arc;
use std::time::{Duration, Instant};
pub use validation::Validation;

/// So many steps in a row without a finite loss end a run.
const MOST_SKIPPED: u64 = 20;

/// What a run is made of.
pub struct Trainer<T: Task> {
    task: T,
    config: TrainConfig,
    device: Device,
    model: T::Model,
    adam: Adam,
    step: u64,
    /// Seconds of training before this process.
    seconds_before: f64,
    started: Instant,
    best: Option<f64>,
    skipped: u64,
    /// Whether normalisation goes by its running statistics.
    fixed: bool,
    peak_gflops: f64,
    feed: Feed<Sample>,
    validation: Option<Validation>,
    log: Log,
}

/// How a run ended.
#[derive(Clone, Debug, PartialEq)]
pub struct Ended {
    /// Steps done, over all resumes.
    pub step: u64,
    /// Whether that is all that were asked for; otherwise its time was up.
    pub finished: bool,
    /// The share of this process's time that the trainer waited for samples.
    pub waited_share: f64,
}

impl<T: Task> Trainer<T> {
    /// Prepares a run on `device` (without autodiff), fresh or from a checkpoint.
    ///
    /// # Errors
    /// Scans that do not fit the configuration, or a checkpoint of another network.
    pub fn new(
        task: T,
        config: TrainConfig,
        resume: Option<Checkpoint>,
        training: Arc<ScanSet>,
        held_out: Option<Arc<ScanSet>>,
        device: Device,
    ) -> Result<Self, TrainError> {
        let training_device = device.clone().autodiff();
        let (model, adam, state) = match resume {
            None => {
                let model = task.fresh(config.seed, &training_device)?;
                (model, Adam::default(), None)
            }
            Some(checkpoint) => {
                fits(&config, &checkpoint.state.config)?;
                let model = task.load(&checkpoint.weights, &training_device)?;
                let adam = Adam::from_numbers(checkpoint.adam, &device);
                (model, adam, Some(checkpoint.state))
            }
        };
        let step = state.as_ref().map_or(0, |state| state.step);
        let options = sample_options(&config, config.augment);
        let first = step * config.train.batch as u64;
        let feed = Feed::start(config.data.threads, config.data.ahead, first, move || {
            let mut sampler = Sampler::new(training.clone(), options);
            move |number| sampler.sample(number)
        })?;
        let validation = held_out.map(|set| Validation::new(set, &config));
        let mut log = Log::open(&config.output.folder, step)?;
        let peak_gflops = cost::peak_gflops(&device);
        let parameters = model.num_params();
        let fields = vec![
            ("device", format!("{device:?}").into()),
            ("peak_gflops", peak_gflops.into()),
            ("parameters", parameters.into()),
            ("config", serde_json::to_value(&config).unwrap_or_default()),
        ];
        log.line("start", step, fields)?;
        Ok(Self {
            task,
            device,
            model,
            adam,
            step,
            seconds_before: state.as_ref().map_or(0.0, |state| state.seconds),
            started: Instant::now(),
            best: state.and_then(|state| state.best),
            skipped: 0,
            fixed: false,
            peak_gflops,
            feed,
            validation,
            log,
            config,
        })
    }

    /// Trains until the last step, or until the time is up; then writes a checkpoint. `told` hears of every step and look.
    ///
    /// # Errors
    /// A sample that cannot be made, a folder that cannot be written, a loss that runs away.
    pub fn run(&mut self, mut told: impl FnMut(&str)) -> Result<Ended, TrainError> {
        let limit = self.config.train.minutes;
        let limit = limit.map(|minutes| Duration::from_secs_f64(60.0 * minutes.max(0.0)));
        let between =
            Duration::from_secs_f64(60.0 * self.config.output.checkpoint_minutes.max(0.0));
        let mut written = Instant::now();
        let time_is_up = |started: Instant| limit.is_some_and(|limit| started.elapsed() >= limit);
        while self.step < self.config.train.steps && !time_is_up(self.started) {
            let said = self.train_step()?;
            if let Some(said) = said {
                told(&said);
            }
            if self.step.is_multiple_of(self.config.output.validate_every) {
                told(&self.validate()?);
            }
            if self
                .step
                .is_multiple_of(self.config.output.checkpoint_every)
                || written.elapsed() >= between
            {
                self.checkpoint()?
                    .write(&self.config.output.folder, self.config.output.keep)?;
                written = Instant::now();
            }
        }
        let written = self
            .checkpoint()?
            .write(&self.config.output.folder, self.config.output.keep)?;
        told(&format!(
            "step {}: checkpoint in {}",
            self.step,
            written.display()
        ));
        let waited = self.feed.waited().as_secs_f64() / self.started.elapsed().as_secs_f64();
        let fields = vec![
            ("waited_share", waited.into()),
            ("sample_s", self.feed.mean_making().as_secs_f64().into()),
        ];
        self.log.line("end", self.step, fields)?;
        plot::write(
            &self.config.output.folder,
            &log::read(&self.config.output.folder)?,
        )?;
        Ok(Ended {
            step: self.step,
            finished: self.step >= self.config.train.steps,
            waited_share: waited,
        })
    }

    /// The network as it is, for looking only: without autodiff, statistics up to date.
    pub fn model(&self) -> T::Model {
        self.model.valid()
    }

    /// Where the run stands.
    ///
    /// # Errors
    /// Weights that are of no use to go on from.
    pub fn checkpoint(&self) -> Result<Checkpoint, TrainError> {
        Ok(Checkpoint {
            state: RunState {
                step: self.step,
                seconds: self.seconds_before + self.started.elapsed().as_secs_f64(),
                best: self.best,
                config: self.config.clone(),
            },
            weights: self.task.save(&self.model.valid())?,
            adam: self.adam.numbers(),
        })
    }

    /// One step; gives a line to show where one is due.
    fn train_step(&mut self) -> Result<Option<String>, TrainError> {
        let started = Instant::now();
        let fixed_from = self.config.train.statistics_fixed_from;
        if !self.fixed && fixed_from.is_some_and(|from| self.step >= from) {
            self.model = fix_statistics(self.model.clone());
            self.fixed = true;
        }
        let waited_before = self.feed.waited();
        let batch = self.config.train.batch;
        let device = self.device.clone().autodiff();
        let mut grads = GradientsAccumulator::new();
        let mut numbers = Numbers::default();
        let (mut macs, mut backward) = (0.0, Duration::ZERO);
        for k in 0..batch {
            let sample = self.feed.take()?;
            let moment = Moment {
                seed: self.config.seed ^ (self.step * batch as u64 + k as u64),
                fine_tune: self.config.fine_tunes(self.step),
                descent: Descent::Taught,
            };
            let outcome = self.task.look(&self.model, &sample, &moment, &device);
            macs += self
                .task
                .forward_macs(sample.views.len(), outcome.sites, outcome.pairs);
            let loss = numbers.add(outcome);
            let before_backward = Instant::now();
            let found = GradientsParams::from_grads(loss.backward(), &self.model);
            grads.accumulate(&self.model, found);
            backward += before_backward.elapsed();
        }
        let rate = self.config.rate(self.step);
        let before_update = Instant::now();
        let norm = self.update(grads.grads(), rate, batch)?;
        let update = before_update.elapsed();
        self.step += 1;
        if !self.step.is_multiple_of(self.config.output.log_every) {
            return Ok(None);
        }
        let seconds = started.elapsed().as_secs_f64();
        let waited = (self.feed.waited() - waited_before).as_secs_f64();
        // Backward costs about twice as much as forward; a multiply-add is two operations.
        let gflops = 3.0 * 2.0 * macs / seconds / 1e9;
        let mut fields = numbers.fields();
        let timings: Vec<(&str, Value)> = vec![
            ("rate", rate.into()),
            ("gradient", norm.into()),
            ("step_s", seconds.into()),
            ("backward_s", backward.as_secs_f64().into()),
            ("update_s", update.as_secs_f64().into()),
            ("waited_s", waited.into()),
            ("samples_per_s", (batch as f64 / seconds).into()),
            ("gflops", gflops.into()),
            ("peak_share", (gflops / self.peak_gflops).into()),
            (
                "elapsed_s",
                (self.seconds_before + self.started.elapsed().as_secs_f64()).into(),
            ),
        ];
        fields.extend(timings);
        let said = format!(
            "step {} of {}: loss {:.4}, {seconds:.2} s, waited {:.0} %, {gflops:.0} GFLOP/s",
            self.step,
            self.config.train.steps,
            numbers.loss(),
            100.0 * waited / seconds,
        );
        self.log.line("step", self.step, fields)?;
        Ok(Some(said))
    }

    /// Steps down the mean gradient of a batch, shortened where it is too long; gives its length. A gradient that is not
    /// finite is passed over.
    fn update(
        &mut self,
        grads: GradientsParams,
        rate: f64,
        batch: usize,
    ) -> Result<f64, TrainError> {
        let norm = adam::norm(&self.model, &grads) / batch as f64;
        if !norm.is_finite() {
            self.skipped += 1;
            if self.skipped >= MOST_SKIPPED {
                return Err(TrainError::Diverged {
                    step: self.step,
                    steps: self.skipped,
                });
            }
            return Ok(norm);
        }
        self.skipped = 0;
        let shorten = self
            .config
            .train
            .clip
            .map_or(1.0, |clip| (clip / norm).min(1.0));
        let model = self.model.clone();
        self.model = self.adam.step(model, rate, shorten / batch as f64, grads);
        Ok(norm)
    }

    /// Looks at the held-out scans, if there are any; keeps the best.
    fn validate(&mut self) -> Result<String, TrainError> {
        if let Some(validation) = &mut self.validation {
            let started = Instant::now();
            let fine_tune = self.config.fine_tunes(self.step);
            let model = self.model.valid();
            let numbers = validation.look(&self.task, &model, fine_tune, &self.device)?;
            let mut fields = numbers.fields();
            fields.push(("seconds", started.elapsed().as_secs_f64().into()));
            self.log.line("validation", self.step, fields)?;
            let loss = numbers.loss();
            if self.best.is_none_or(|best| loss < best) {
                self.best = Some(loss);
                self.checkpoint()?.write_best(&self.config.output.folder)?;
            }
            plot::write(
                &self.config.output.folder,
                &log::read(&self.config.output.folder)?,
            )?;
            return Ok(format!("step {}: held out: {}", self.step, numbers.said()));
        }
        plot::write(
            &self.config.output.folder,
            &log::read(&self.config.output.folder)?,
        )?;
        Ok(format!("step {}: no held-out scans to look at", self.step))
    }
}

/// From here on normalisation goes by its running statistics, which stay as they are, in training as in use.
fn fix_statistics<M: Module>(model: M) -> M {
    // The statistics lag one update behind until somebody asks for a copy to look with.
    drop(model.valid());
    model.map(&mut Fix)
}

struct Fix;

impl ModuleMapper for Fix {
    fn map_flag(&mut self, flag: Param<Flag>) -> Param<Flag> {
        flag.with_value(false)
    }
}

/// How samples are made for a configuration.
fn sample_options(config: &TrainConfig, augment: Augment) -> SampleOptions {
    SampleOptions {
        seed: config.seed,
        views: [
            config.data.least_views.unwrap_or(config.data.views),
            config.data.views,
        ],
        size: config.data.size,
        crop: config.data.crop,
        least_seen: config.data.least_seen,
        guide: config.net.config().guide,
        augment,
    }
}

/// Whether a run can go on under `now` that was begun under `then`.
fn fits(now: &TrainConfig, then: &TrainConfig) -> Result<(), TrainError> {
    if now.net.config() == then.net.config() {
        return Ok(());
    }
    Err(TrainError::unfit(
        "--resume",
        format!(
            "a checkpoint of the network that the settings name, {:?}",
            now.net.config()
        ),
        format!("one of {:?}", then.net.config()),
        "go on with the settings that the run was begun with, or start anew without --resume",
    ))
}
