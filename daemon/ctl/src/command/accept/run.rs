//! The acceptance itself.

use deliverables::{AcceptanceReport, DeliverError, acceptance_page, write_atomically};
use jiff::Timestamp;
use metrology::Scan;
use reliefd::calibration::{CalibrationFile, InForce, USUAL_DAYS};

use super::reference::Reference;
use super::{Args, judge, measure, reference, summary};
use crate::command::{pages, places};
use crate::failure::Failure;
use crate::output;
use crate::raw_scan::{self, RawScan};

/// Measures, judges, tells, and writes what is asked for.
pub(crate) async fn run(args: Args, json: bool) -> Result<(), Failure> {
    args.report.as_deref().map_or(Ok(()), places::check_file)?;
    pages::check(&args.page)?;
    let reference = reference::read(&args.reference)?;
    let scans = raw_scan::read_all(&args.scans, &args.endpoint).await?;
    let report = judged(&args, &reference, &scans)?;
    for warning in &report.warnings {
        eprintln!("relief: note: {warning}");
    }
    if let Some(path) = &args.report {
        write_atomically::<DeliverError>(path, |sink| {
            serde_json::to_writer_pretty(&mut *sink, &report)?;
            Ok(sink.write_all(b"\n")?)
        })
        .map_err(|error| Failure::at(format!("cannot write {}", path.display()), &error))?;
    }
    let latest = scans.iter().filter_map(|own| own.started_at).max();
    pages::write(
        &args.page,
        &acceptance_page(&report, latest.unwrap_or(Timestamp::UNIX_EPOCH)),
    )?;
    output::either(json, &report, summary::told)?;
    if report.passed {
        return Ok(());
    }
    Err(Failure::Failed(summary::verdict(&report)))
}

fn judged(
    args: &Args,
    reference: &Reference,
    scans: &[RawScan],
) -> Result<AcceptanceReport, Failure> {
    let Some(first) = scans.first() else {
        return Err(Failure::Usage("name scans to judge".into()));
    };
    let mut warnings: Vec<String> = scans.iter().flat_map(|own| own.notes.clone()).collect();
    let instead = args
        .calibration
        .as_deref()
        .map(CalibrationFile::read)
        .transpose();
    let instead = instead.map_err(|error| Failure::Failed(error.to_string()))?;
    let mut told = Vec::new();
    for own in scans {
        let scan = with_correction(own, instead.as_ref())?;
        told.push(measure::measured(own, &scan, reference, &mut warnings)?);
    }
    let latest = scans.iter().filter_map(|own| own.started_at).max();
    let in_force = match instead {
        Some(file) => Some(InForce {
            file,
            calibration_days: USUAL_DAYS,
        }),
        None => one_calibration(scans)?,
    };
    warnings.extend(
        in_force
            .as_ref()
            .zip(latest)
            .and_then(|(own, at)| own.overdue(at)),
    );
    let (repeatability, drift) = judge::series(&told, reference);
    let figures = judge::figures(&told, &repeatability, &drift, &reference.limits)
        .map_err(|what| Failure::Failed(format!("{}: {what}", args.reference.display())))?;
    if figures.iter().all(|own| own.passed.is_none()) {
        warnings.push(format!(
            "{} has no limits, so that nothing was judged",
            args.reference.display()
        ));
    }
    Ok(AcceptanceReport {
        passed: figures.iter().all(|own| own.passed != Some(false)),
        reference: reference.name.clone(),
        scanner: first.who(),
        calibration: in_force.map(|own| own.report(latest)),
        figures,
        scans: told,
        repeatability,
        drift,
        warnings,
    })
}

/// The scan with the correction that is judged.
fn with_correction(own: &RawScan, instead: Option<&CalibrationFile>) -> Result<Scan, Failure> {
    let mut scan = own.scan.clone();
    if let Some(file) = instead {
        let announced = scan.calibration.as_announced();
        let correction = file
            .for_scanner(&own.model, &own.serial, &announced, "scanner")
            .map_err(|error| Failure::Failed(format!("{}: {error}", own.name)))?;
        scan.calibration.correction = Some(correction);
    }
    Ok(scan)
}

/// The calibration that all scans were taken with.
fn one_calibration(scans: &[RawScan]) -> Result<Option<InForce>, Failure> {
    let mut own = scans.iter();
    let Some(first) = own.next() else {
        return Ok(None);
    };
    for other in own {
        if other.scan.calibration != first.scan.calibration {
            return Err(Failure::Failed(format!(
                "{} was taken with another calibration than {}: give scans of one calibration, or \
                 one for all by --calibration",
                other.name, first.name
            )));
        }
    }
    Ok(first.in_force.clone())
}
