//! Scenes that are rendered and differentiated from Python.

use std::path::PathBuf;
use std::sync::{Mutex, MutexGuard, PoisonError, TryLockError};
use std::thread::ThreadId;
use std::time::Duration;

use drt_cli::{CliError, Defaults, Job, Overrides, PreparedJob, Samples, Unknown};
use numpy::PyReadonlyArrayDyn;
use pyo3::exceptions::{PyKeyError, PyRuntimeError};
use pyo3::prelude::*;
use pyo3::types::PyDict;

use crate::arrays::{Array, Pair, array, layer, numbers, pixels};
use crate::errors::{Error, raised};
use crate::tables;
use crate::watch::Watch;

/// How long to wait for another thread before the interpreter is asked whether to stop.
const PATIENCE: Duration = Duration::from_millis(5);

/// A scene with its unknowns and its sessions. One call is served at a time, calls from other threads wait.
#[pyclass(frozen, module = "drt._core")]
pub(crate) struct Scene {
    prepared: Mutex<PreparedJob>,
    /// The thread whose call is served.
    served: Mutex<Option<ThreadId>>,
    /// The process that it was made in, which has its threads.
    process: u32,
}

/// The scene while a call is served.
pub(crate) struct Turn<'a> {
    pub(crate) prepared: MutexGuard<'a, PreparedJob>,
    served: &'a Mutex<Option<ThreadId>>,
}

impl Drop for Turn<'_> {
    fn drop(&mut self) {
        *locked(self.served) = None;
    }
}

fn locked<T>(mutex: &Mutex<T>) -> MutexGuard<'_, T> {
    mutex.lock().unwrap_or_else(PoisonError::into_inner)
}

impl Scene {
    fn of(py: Python<'_>, read: impl Send + FnOnce() -> Result<Job, CliError>) -> PyResult<Self> {
        let prepared = py.detach(|| read().and_then(PreparedJob::new));
        let prepared = Mutex::new(prepared.map_err(|e| raised(&e))?);
        Ok(Self { prepared, served: Mutex::new(None), process: std::process::id() })
    }

    /// Waits for the calls of other threads.
    pub(crate) fn turn(&self, py: Python<'_>) -> PyResult<Turn<'_>> {
        if self.process != std::process::id() {
            let message = "a scene cannot be used in a forked process, which lacks its threads; expected one that was spawned";
            return Err(PyRuntimeError::new_err(message));
        }
        let this = std::thread::current().id();
        loop {
            if *locked(&self.served) == Some(this) {
                let message =
                    "a scene that is being sampled cannot be used from its progress callback";
                return Err(PyRuntimeError::new_err(message));
            }
            let prepared = match self.prepared.try_lock() {
                Ok(prepared) => Some(prepared),
                Err(TryLockError::Poisoned(left)) => Some(left.into_inner()),
                Err(TryLockError::WouldBlock) => None,
            };
            if let Some(prepared) = prepared {
                *locked(&self.served) = Some(this);
                return Ok(Turn { prepared, served: &self.served });
            }
            py.check_signals()?;
            py.detach(|| std::thread::sleep(PATIENCE));
        }
    }

    /// Samples without the interpreter's lock.
    fn sample<T: Send>(
        &self,
        py: Python<'_>,
        given: Given,
        run: impl Send + FnOnce(&mut PreparedJob, Samples, &Watch) -> Result<Option<T>, CliError>,
    ) -> PyResult<T> {
        let mut turn = self.turn(py)?;
        let prepared = &mut *turn.prepared;
        let samples = given.samples(prepared)?;
        let watch = Watch::new(given.progress);
        let found = py.detach(|| run(prepared, samples, &watch));
        watch.finish(found.map_err(|e| raised(&e))?)
    }
}

/// What may be said of a call's samples.
struct Given {
    spp: Option<u32>,
    seed: Option<u64>,
    sensor: Option<String>,
    progress: Option<Py<PyAny>>,
}

impl Given {
    fn samples(&self, prepared: &PreparedJob) -> PyResult<Samples> {
        let own = prepared.samples();
        let spp = self.spp.unwrap_or(own.spp);
        if spp == 0 {
            return Err(Error::new_err("`spp` is 0; expected at least 1"));
        }
        let seed = self.seed.unwrap_or(own.seed);
        let sensor = sensor(prepared, self.sensor.as_deref())?;
        Ok(Samples { spp, seed, sensor })
    }
}

fn sensor(prepared: &PreparedJob, name: Option<&str>) -> PyResult<usize> {
    let Some(name) = name else { return Ok(prepared.samples().sensor) };
    prepared.job().find_sensor(name).map_err(|e| raised(&e))
}

pub(crate) fn find(prepared: &PreparedJob, name: &str) -> PyResult<Unknown> {
    let found = prepared.unknowns().find(|(known, _)| *known == name);
    found.map(|(_, unknown)| unknown).ok_or_else(|| {
        let known: Vec<&str> = prepared.unknowns().map(|(name, _)| name).collect();
        let known = if known.is_empty() { "nothing".into() } else { known.join(", ") };
        PyKeyError::new_err(format!("there is no parameter `{name}`; there are {known}"))
    })
}

#[pymethods]
impl Scene {
    /// Reads a scene, or a job if the file's name ends in `.toml`.
    #[staticmethod]
    fn load(
        py: Python<'_>,
        path: PathBuf,
        defaults: Defaults,
        set: Vec<(String, String)>,
    ) -> PyResult<Self> {
        Self::of(py, move || {
            if path.extension().is_some_and(|e| e.eq_ignore_ascii_case("toml")) {
                return drt_cli::read_job(
                    &path,
                    &Overrides { set, defaults, ..Overrides::default() },
                );
            }
            Job::read_scene(&path, &defaults).map(Job::with_all_groups)
        })
    }

    /// Reads a job from a dictionary with its keys; relative file names start from the folder.
    #[staticmethod]
    fn from_keys(
        py: Python<'_>,
        keys: &Bound<'_, PyDict>,
        folder: PathBuf,
        defaults: Defaults,
    ) -> PyResult<Self> {
        let text = tables::text(keys)?;
        let overrides = Overrides { defaults, ..Overrides::default() };
        Self::of(py, move || {
            drt_cli::decode_job(text.as_bytes(), &folder.join("<job>"), &overrides)
        })
    }

    /// The text of the job; `None` of a scene alone.
    fn text(&self, py: Python<'_>) -> PyResult<Option<String>> {
        Ok(self.turn(py)?.prepared.job().text.clone())
    }

    /// What was passed over.
    fn warnings(&self, py: Python<'_>) -> PyResult<Vec<String>> {
        let turn = self.turn(py)?;
        Ok(turn.prepared.job().warnings.iter().map(ToString::to_string).collect())
    }

    /// Samples per pixel, and the seed, where a call does not say otherwise.
    fn samples(&self, py: Python<'_>) -> PyResult<(u32, u64)> {
        let Samples { spp, seed, .. } = self.turn(py)?.prepared.samples();
        Ok((spp, seed))
    }

    /// The names of all sensors.
    fn sensors(&self, py: Python<'_>) -> PyResult<Vec<String>> {
        let turn = self.turn(py)?;
        let sensors = turn.prepared.job().scene.sensors.iter().enumerate();
        Ok(sensors.map(|(i, s)| s.id.clone().unwrap_or(format!("sensor[{i}]"))).collect())
    }

    /// Columns and rows of a sensor's image.
    fn size(&self, py: Python<'_>, name: Option<&str>) -> PyResult<[u32; 2]> {
        let turn = self.turn(py)?;
        let index = sensor(&turn.prepared, name)?;
        let sensor = turn.prepared.job().scene.sensors.get(index);
        let film = sensor.map(|sensor| sensor.item.sensor.film());
        film.ok_or_else(|| Error::new_err("the scene has no <sensor>"))
    }

    /// Gives a sensor's image another size.
    fn resize(&self, py: Python<'_>, name: Option<&str>, size: [u32; 2]) -> PyResult<()> {
        let mut turn = self.turn(py)?;
        let index = sensor(&turn.prepared, name)?;
        turn.prepared.resize(index, size).map_err(|e| raised(&e))
    }

    /// The names of the parameters, and those of the groups.
    fn unknowns(&self, py: Python<'_>) -> PyResult<[Vec<String>; 2]> {
        let turn = self.turn(py)?;
        let mut names = [Vec::new(), Vec::new()];
        for (name, unknown) in turn.prepared.unknowns() {
            names[usize::from(matches!(unknown, Unknown::Group(_)))].push(name.to_owned());
        }
        Ok(names)
    }

    /// The values of an unknown.
    fn values<'py>(&self, py: Python<'py>, name: &str) -> PyResult<Array<'py>> {
        let turn = self.turn(py)?;
        let unknown = find(&turn.prepared, name)?;
        let (shape, values) = turn.prepared.values(unknown).unwrap_or_default();
        array(py, shape, values)
    }

    /// Gives some unknowns other values, all of them or none.
    fn set(
        &self,
        py: Python<'_>,
        values: Vec<(String, PyReadonlyArrayDyn<'_, f64>)>,
    ) -> PyResult<()> {
        let mut turn = self.turn(py)?;
        let mut changes = Vec::new();
        for (name, array) in &values {
            changes.push((find(&turn.prepared, name)?, numbers(array)?.to_vec()));
        }
        let prepared = &mut *turn.prepared;
        let set = py.detach(|| {
            let changes: Vec<(Unknown, &[f64])> =
                changes.iter().map(|(unknown, values)| (*unknown, values.as_slice())).collect();
            prepared.set(&changes)
        });
        set.map_err(|e| raised(&e))
    }

    /// The image and its standard errors.
    fn render<'py>(
        &self,
        py: Python<'py>,
        spp: Option<u32>,
        seed: Option<u64>,
        sensor: Option<String>,
        progress: Option<Py<PyAny>>,
    ) -> PyResult<Pair<'py>> {
        let given = Given { spp, seed, sensor, progress };
        let seen =
            self.sample(py, given, |prepared, samples, watch| prepared.render(samples, watch))?;
        layer(py, &seen.image)
    }

    /// The image, and the derivative with respect to each parameter, each with standard errors.
    fn derivatives<'py>(
        &self,
        py: Python<'py>,
        spp: Option<u32>,
        seed: Option<u64>,
        sensor: Option<String>,
        progress: Option<Py<PyAny>>,
    ) -> PyResult<(Pair<'py>, Vec<(String, Pair<'py>)>)> {
        let given = Given { spp, seed, sensor, progress };
        let seen = self
            .sample(py, given, |prepared, samples, watch| prepared.derivatives(samples, watch))?;
        let named = seen.derivatives.iter().map(|d| Ok((d.name.clone(), layer(py, &d.total)?)));
        Ok((layer(py, &seen.image)?, named.collect::<PyResult<_>>()?))
    }

    /// The gradient of a loss with respect to some unknowns, from its derivative with respect to every pixel.
    #[allow(clippy::too_many_arguments)]
    fn gradient<'py>(
        &self,
        py: Python<'py>,
        names: Vec<String>,
        adjoint: PyReadonlyArrayDyn<'py, f64>,
        spp: Option<u32>,
        seed: Option<u64>,
        sensor: Option<String>,
        progress: Option<Py<PyAny>>,
    ) -> PyResult<Vec<Array<'py>>> {
        let given = Given { spp, seed, sensor, progress };
        let adjoint = pixels(&adjoint)?;
        let (wanted, shapes) = {
            let turn = self.turn(py)?;
            let found = names.iter().map(|name| find(&turn.prepared, name));
            let wanted: Vec<Unknown> = found.collect::<PyResult<_>>()?;
            let shape = |unknown: &Unknown| turn.prepared.shape(*unknown).unwrap_or_default();
            let shapes: Vec<Vec<usize>> = wanted.iter().map(shape).collect();
            (wanted, shapes)
        };
        let found = self.sample(py, given, |prepared, samples, watch| {
            prepared.gradient(&wanted, &adjoint, samples, watch)
        })?;
        let arrays =
            found.into_iter().zip(shapes).map(|(numbers, shape)| array(py, shape, numbers));
        arrays.collect()
    }
}
