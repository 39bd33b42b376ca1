//! `relief token`.

use std::fs::OpenOptions;
use std::io::Write;
use std::os::unix::fs::OpenOptionsExt;
use std::path::{Path, PathBuf};

use relief_api::{CreateToken, NewToken, Token, TokenList, path};
use serde::Serialize;

use crate::failure::Failure;
use crate::output;
use crate::service::EndpointArgs;

/// Make, list and revoke the tokens that requests on a loopback address need
///
/// The service asks for a token on the address of `service.listen`, and nowhere else; its
/// socket is for whoever may use the file. A token holds until it is revoked. The service
/// keeps nothing by which it could be found out, so that it is shown only once.
#[derive(Debug, clap::Args)]
pub(crate) struct Args {
    #[command(subcommand)]
    action: Action,
}

#[derive(Debug, clap::Subcommand)]
enum Action {
    /// Make a token and show it, this once
    Create {
        /// What its bearer is called: letters, digits, `.`, `_` and `-`
        name: String,
        /// Write it to a new file that only you can read, instead of showing it
        #[arg(long, short, value_name = "FILE")]
        out: Option<PathBuf>,
        #[command(flatten)]
        endpoint: EndpointArgs,
    },
    /// List the tokens that hold
    List {
        #[command(flatten)]
        endpoint: EndpointArgs,
    },
    /// Take a token back
    Revoke {
        /// The name it was given
        name: String,
        #[command(flatten)]
        endpoint: EndpointArgs,
    },
}

pub(crate) async fn run(args: Args, json: bool) -> Result<(), Failure> {
    match args.action {
        Action::Create {
            name,
            out,
            endpoint,
        } => create(name, out.as_deref(), &endpoint, json).await,
        Action::List { endpoint } => {
            endpoint
                .show(path::TOKENS, json, |list: &TokenList| told(&list.tokens))
                .await
        }
        Action::Revoke { name, endpoint } => {
            let path = path::token_revoke(&name);
            let revoked: Token = endpoint
                .client()?
                .post(&path, &serde_json::json!({}))
                .await?;
            output::either(json, &revoked, |token| {
                format!("the token {} holds no more", token.name)
            })
        }
    }
}

/// What `create --json` prints when the token went to a file.
#[derive(Serialize)]
struct Written<'a> {
    name: &'a str,
    created_at: &'a str,
    file: &'a Path,
}

async fn create(
    name: String,
    out: Option<&Path>,
    endpoint: &EndpointArgs,
    json: bool,
) -> Result<(), Failure> {
    // First, so that no token is made that would have no place.
    let file = out.map(|out| {
        let created = OpenOptions::new()
            .write(true)
            .create_new(true)
            .mode(0o600)
            .open(out)
            .map_err(|error| Failure::at(format!("cannot make {}", out.display()), &error));
        created.map(|file| (out, file))
    });
    let Some((out, mut file)) = file.transpose()? else {
        let token: NewToken = make(name, endpoint).await?;
        return output::either(json, &token, |token| token.token.clone());
    };
    let token = match make(name, endpoint).await {
        Ok(token) => token,
        Err(error) => {
            // It is empty, and ours.
            let _ = std::fs::remove_file(out);
            return Err(error);
        }
    };
    writeln!(file, "{}", token.token)
        .and_then(|()| file.sync_all())
        .map_err(|error| {
            let doing = format!(
                "cannot write {}; revoke the token {}, which is lost",
                out.display(),
                token.name
            );
            Failure::at(doing, &error)
        })?;
    let written = Written {
        name: &token.name,
        created_at: &token.created_at,
        file: out,
    };
    output::either(json, &written, |written| {
        format!("{}", written.file.display())
    })
}

async fn make(name: String, endpoint: &EndpointArgs) -> Result<NewToken, Failure> {
    let client = endpoint.client()?;
    Ok(client.post(path::TOKENS, &CreateToken { name }).await?)
}

fn told(tokens: &[Token]) -> String {
    if tokens.is_empty() {
        return "there are no tokens".into();
    }
    let lines = tokens
        .iter()
        .map(|token| vec![token.name.clone(), token.created_at.clone()]);
    output::table(&["TOKEN", "SINCE"], &[], lines)
}
