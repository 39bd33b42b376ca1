//! Programs that are run for each result.

use std::fs;
use std::path::{Path, PathBuf};
use std::time::Duration;

use relief_api::{Delivery, DeliveryState, HookList, HookRuns, Job, path};
use reliefd::Config;
use reliefd::config::{HookConfig, HookSandbox, Retry};

use crate::rig::{GUARD, Rig};

/// A hook of a shell's words, without delays.
fn hook(name: &str, script: &str) -> HookConfig {
    let mut hook = HookConfig::new(name, &["/bin/sh", "-c", script]);
    hook.helper = Some(env!("CARGO_BIN_EXE_reliefd").into());
    hook.retry = Retry {
        first: Duration::from_millis(10),
        longest: Duration::from_millis(10),
        ..Retry::default()
    };
    hook
}

fn with(hooks: Vec<HookConfig>) -> impl FnOnce(&mut Config) {
    move |config| config.hooks = hooks
}

async fn start(hooks: Vec<HookConfig>) -> Rig {
    Rig::start(tempfile::tempdir().unwrap(), with(hooks)).await
}

async fn runs(rig: &Rig, name: &str) -> Vec<Delivery> {
    let log: HookRuns = rig.client.get(&path::hook_runs(name)).await;
    log.runs
}

/// The newest run once it has come so far.
async fn until(rig: &Rig, name: &str, is_far: impl Fn(&Delivery) -> bool) -> Delivery {
    let found = async {
        loop {
            if let Some(run) = runs(rig, name).await.into_iter().find(&is_far) {
                return run;
            }
            tokio::time::sleep(Duration::from_millis(20)).await;
        }
    };
    let found = tokio::time::timeout(GUARD, found).await;
    match found {
        Ok(run) => run,
        Err(_) => panic!("the hook {name} stays at {:?}", runs(rig, name).await),
    }
}

async fn done(rig: &Rig, name: &str) -> Delivery {
    until(rig, name, |run| run.state == DeliveryState::Delivered).await
}

fn said(run: &Delivery) -> &str {
    let tried = run.tried.last().unwrap();
    tried.answer.as_deref().unwrap_or_default()
}

/// A whole line of what it said.
fn says(run: &Delivery, line: &str) -> bool {
    said(run).lines().any(|said| said == line)
}

#[tokio::test(flavor = "multi_thread")]
async fn a_hook_hears_of_the_result_and_keeps_to_its_folders() {
    let script = "set -u
        env | sort
        read line || echo 'no input'
        head -c 1 \"$RELIEF_MANIFEST\"; echo
        echo x > here && echo \"writes $(cat here)\"
        for other in \"$RELIEF_DIRECTORY/x\" ../x; do
            echo x 2> /dev/null > \"$other\" || echo \"no writing $other\"
        done
        for other in \"$1\" /etc/relief/lab.secret; do
            cat \"$other\" > /dev/null 2>&1 || echo \"no reading $other\"
        done";
    let folder = tempfile::tempdir().unwrap();
    let other = folder.path().join("secret");
    fs::write(&other, "s").unwrap();
    let mut confined = hook("confined", script);
    confined
        .command
        .extend(["sh".into(), other.display().to_string()]);
    let rig = start(vec![confined]).await;
    let (_, job) = rig.scan_to_result("roof").await;
    let run = done(&rig, "confined").await;
    assert_eq!((run.attempts, run.tried[0].status), (1, Some(0)));
    let directory = rig.daemon.spool_dir().join(&job.result);
    let directory = directory.display();
    for line in [
        "HOME=/nonexistent".to_owned(),
        "RELIEF_EVENT=published".to_owned(),
        format!("RELIEF_RESULT={}", job.result),
        format!("RELIEF_DIRECTORY={directory}"),
        format!("RELIEF_MANIFEST={directory}/manifest.json"),
        format!("RELIEF_SCAN={}", job.scan),
        "RELIEF_NAME=roof".to_owned(),
        "no input".to_owned(),
        "{".to_owned(),
        "writes x".to_owned(),
    ] {
        assert!(says(&run, &line), "{line}: {}", said(&run));
    }
    // Nothing that the service has been told goes on to it.
    let names = said(&run).lines().filter_map(|line| line.split_once('='));
    let foreign = |name: &str| {
        let usual = [
            "HOME", "LANG", "PATH", "PWD", "OLDPWD", "SHLVL", "TMPDIR", "_",
        ];
        !usual.contains(&name) && !name.starts_with("RELIEF_")
    };
    let foreign: Vec<&str> = names.map(|(name, _)| name).filter(|n| foreign(n)).collect();
    assert!(foreign.is_empty(), "{foreign:?}");
    if said(&run).contains("no Landlock") {
        eprintln!("skipped in part: this kernel has no Landlock");
    } else {
        for line in [
            format!("no writing {directory}/x"),
            "no writing ../x".to_owned(),
            format!("no reading {}", other.display()),
        ] {
            assert!(says(&run, &line), "{line}: {}", said(&run));
        }
    }
    // Its folder is gone.
    let left = rig.folder.path().join("state/hooks");
    assert_eq!(fs::read_dir(left).unwrap().count(), 0);
    rig.daemon.shutdown().await;
}

#[tokio::test(flavor = "multi_thread")]
async fn limits_hold_without_landlock_as_well() {
    let mut limited = hook(
        "limited",
        "grep NoNewPrivs /proc/self/status; cat /proc/self/limits",
    );
    limited.sandbox = HookSandbox::Off;
    limited.memory_mb = 1_000;
    limited.file_mb = 3;
    let mut large = hook("large", "exec head -c 4000000 /dev/zero > large");
    large.file_mb = 3;
    let rig = start(vec![limited, large]).await;
    rig.scan_to_result("a").await;
    let run = done(&rig, "limited").await;
    let words: Vec<Vec<&str>> = said(&run)
        .lines()
        .map(|line| line.split_whitespace().collect())
        .collect();
    let has = |line: &[&str]| words.iter().any(|words| words.starts_with(line));
    for line in [
        &["NoNewPrivs:", "1"][..],
        &["Max", "cpu", "time", "300", "300"],
        &["Max", "file", "size", "3000000", "3000000"],
        &["Max", "core", "file", "size", "0", "0"],
        &["Max", "processes", "512", "512"],
        &["Max", "open", "files", "1024", "1024"],
        &["Max", "address", "space", "1000000000", "1000000000"],
    ] {
        assert!(has(line), "{line:?}: {}", said(&run));
    }
    let run = until(&rig, "large", |run| run.attempts > 0).await;
    let error = run.tried[0].error.as_deref().unwrap();
    assert!(error.contains("file_mb"), "{error}");
    rig.daemon.shutdown().await;
}

#[tokio::test(flavor = "multi_thread")]
async fn what_fails_is_run_again_and_what_waits_outlives_the_service_and_the_limits() {
    // Only the service's user can write there, so that no sandbox is in the way.
    let folder = tempfile::tempdir().unwrap();
    let mark = folder.path().join("mark");
    let script = format!(
        "echo tried; test -e {0} || {{ touch {0}; exit 3; }}",
        mark.display()
    );
    let mut second = hook("second", &script);
    second.sandbox = HookSandbox::Off;
    let mut late = hook("late", "exit 1");
    late.retry.first = Duration::from_secs(3_600);
    late.retry.longest = late.retry.first;
    let rig = start(vec![second, late]).await;
    let (_, job) = rig.scan_to_result("a").await;
    let run = done(&rig, "second").await;
    let codes: Vec<_> = run.tried.iter().map(|tried| tried.status).collect();
    assert_eq!(codes, [Some(3), Some(0)]);
    assert_eq!(run.tried[0].error.as_deref(), Some("exit code 3"));
    assert_eq!(run.tried[0].answer.as_deref(), Some("tried"));
    let waits = until(&rig, "late", |run| run.attempts == 1).await;
    assert!(waits.next_attempt_at.is_some());
    let list: HookList = rig.client.get(path::HOOKS).await;
    let waiting: Vec<usize> = list.hooks.iter().map(|hook| hook.waiting).collect();
    assert_eq!(waiting, [0, 1]);
    let _: Job = rig.client.ask(&path::spool_ack(&job.result)).await;

    let mended = |script: &str| {
        let hook = hook("late", script);
        move |config: &mut Config| {
            config.hooks = vec![hook];
            config.storage.acknowledged = reliefd::config::Acknowledged::Remove;
        }
    };
    // The result stays for as long as a hook is to be run for it.
    let rig = rig
        .restart_with(mended("test -r \"$RELIEF_MANIFEST\""))
        .await;
    let run = done(&rig, "late").await;
    assert_eq!(run.attempts, 2);
    let rig = rig.restart_with(mended("false")).await;
    assert!(!rig.daemon.spool_dir().join(&job.result).exists());
    assert_eq!(runs(&rig, "late").await.len(), 1);
    rig.daemon.shutdown().await;
}

fn is_there(pid: &str) -> bool {
    let status = fs::read_to_string(Path::new("/proc").join(pid).join("stat"));
    // Nobody has waited for it yet, but it runs no more.
    status.is_ok_and(|status| !status.contains(") Z "))
}

#[tokio::test(flavor = "multi_thread")]
async fn what_takes_too_long_is_killed_with_all_that_it_began() {
    let mut slow = hook("slow", "sleep 600 & echo $!; echo $$; wait");
    slow.timeout_s = 1;
    let behind = hook("behind", "sleep 600 > /dev/null 2>&1 & echo $!");
    let rig = start(vec![slow, behind]).await;
    rig.scan_to_result("a").await;
    let run = until(&rig, "slow", |run| run.attempts > 0).await;
    let error = run.tried[0].error.as_deref().unwrap();
    assert!(error.contains("1 s (timeout_s), and was killed"), "{error}");
    let behind = done(&rig, "behind").await;
    let pids: Vec<&str> = run.tried[0]
        .answer
        .iter()
        .flat_map(|said| said.lines())
        .collect();
    assert_eq!(pids.len(), 2);
    for pid in pids.into_iter().chain([said(&behind)]) {
        // The system may take a moment to take away what was killed.
        let gone = async {
            while is_there(pid) {
                tokio::time::sleep(Duration::from_millis(5)).await;
            }
        };
        let gone = tokio::time::timeout(GUARD, gone).await;
        assert!(gone.is_ok(), "{pid} still runs");
    }
    rig.daemon.shutdown().await;
}

#[tokio::test(flavor = "multi_thread")]
async fn a_test_runs_a_hook_for_the_newest_result_and_says_what_came_of_it() {
    let none = hook("none", "x");
    let rig = start(vec![
        hook("check", "echo \"$RELIEF_EVENT $RELIEF_NAME\""),
        none,
    ])
    .await;
    let refused = async |name: &str| {
        let path = path::hook_test(name);
        rig.client.request("POST", &path, None).await.problem()
    };
    assert_eq!(refused("check").await.kind, "no-result");
    let unknown = refused("chek").await;
    assert_eq!(
        (unknown.status, unknown.kind.as_str()),
        (404, "no-such-hook")
    );
    assert!(
        unknown.detail.ends_with("there are check, none"),
        "{}",
        unknown.detail
    );
    rig.scan_to_result("first").await;
    rig.scan_to_result("second").await;
    let run: Delivery = rig.client.ask(&path::hook_test("check")).await;
    assert_eq!(
        (run.state, said(&run)),
        (DeliveryState::Delivered, "test second")
    );
    // Nor are hooks among the webhooks.
    let path = path::webhook_test("check");
    let problem = rig.client.request("POST", &path, None).await.problem();
    assert_eq!(problem.kind, "no-such-webhook");
    let missing: Delivery = rig.client.ask(&path::hook_test("none")).await;
    assert_eq!(missing.state, DeliveryState::GivenUp);
    assert_eq!(missing.tried[0].status, Some(127));
    rig.daemon.shutdown().await;
}

fn unsound(text: &str) -> String {
    let parsed = Config::parse(text, Path::new("relief.toml"));
    parsed.unwrap_err().to_string()
}

#[test]
fn hooks_are_programs_by_their_whole_path_and_have_names_of_their_own() {
    let hook = |keys: &str| unsound(&format!("[[hooks]]\nname = \"check\"\n{keys}"));
    assert_eq!(
        hook("command = [\"check-part\"]\n"),
        "relief.toml, line 3, column 11: \"check-part\" is no whole path: the first word is a program \
         such as \"/usr/local/bin/accept-part\", and no shell"
    );
    let whole = "command = [\"/bin/true\"]\n";
    assert_eq!(
        hook(&format!("{whole}events = []\n")),
        "relief.toml, line 4, column 10: a hook without events is never run: use [\"published\"], or \
         remove it"
    );
    let webhook =
        "[[webhooks]]\nname = \"check\"\nurl = \"http://a.example/\"\nsecret_file = \"s\"\n";
    assert_eq!(
        hook(&format!("{whole}{webhook}")),
        "relief.toml, line 2, column 8: there is a webhook check in line 5 already: each has its own \
         name"
    );
    // The program is looked for where files are.
    let folder = tempfile::tempdir().unwrap();
    let file = folder.path().join("relief.toml");
    let text = format!(
        "[[hooks]]\nname = \"check\"\ncommand = [{:?}]\n",
        folder.path()
    );
    std::fs::write(&file, text).unwrap();
    let error = Config::load_with_files(&file).unwrap_err().to_string();
    assert!(
        error.contains("line 3") && error.contains("chmod +x"),
        "{error}"
    );
    std::fs::write(&file, format!("[[hooks]]\nname = \"check\"\n{whole}")).unwrap();
    let sound = Config::load_with_files(&file).unwrap();
    assert_eq!(sound.hooks, [HookConfig::new("check", &["/bin/true"])]);
}

/// The state folder may be named from where the service was started.
#[tokio::test(flavor = "multi_thread")]
async fn a_hook_has_a_folder_also_where_that_of_the_service_is_relative() {
    let here = std::env::current_dir().unwrap();
    let up: PathBuf = here.components().skip(1).map(|_| "..").collect();
    let folder = tempfile::tempdir().unwrap();
    let rig = Rig::start(folder, |config| {
        let whole = &config.service.state_dir;
        config.service.state_dir = up.join(whole.strip_prefix("/").unwrap());
        config.hooks = vec![hook("writer", "echo x > here && cat here")];
    })
    .await;
    rig.scan_to_result("roof").await;
    let run = done(&rig, "writer").await;
    assert!(says(&run, "x"), "{}", said(&run));
    rig.daemon.shutdown().await;
}
