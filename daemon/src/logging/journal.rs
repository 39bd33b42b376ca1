//! Entries of the systemd journal that can be read as they are listed.
//!
//! `journalctl` shows an entry's message and none of its fields. So the values that belong to a
//! message are put into its text too, as the log for people has them.

use tracing::field::{Field, Value, Visit};
use tracing::{Event, Subscriber, span};
use tracing_journald::{Priority, PriorityMappings};
use tracing_subscriber::Layer;
use tracing_subscriber::fmt::FormatFields;
use tracing_subscriber::fmt::format::{DefaultFields, Writer};
use tracing_subscriber::layer::Context;
use tracing_subscriber::registry::LookupSpan;

/// A message's fields become fields of the journal's entry: `scan` is `RELIEF_SCAN`.
pub(super) fn layer<S>() -> std::io::Result<impl Layer<S>>
where
    S: Subscriber + for<'a> LookupSpan<'a>,
{
    let layer = tracing_journald::layer()?
        .with_syslog_identifier("reliefd".into())
        .with_field_prefix(Some("RELIEF".into()))
        .with_priority_mappings(PriorityMappings {
            info: Priority::Informational,
            debug: Priority::Debug,
            ..PriorityMappings::new()
        });
    Ok(Readable(layer))
}

/// The name of the field with an event's text.
const MESSAGE: &str = "message";

/// Most fields of an event: `tracing` allows no more.
const MOST_FIELDS: usize = 32;

/// Passes events on whose message ends with the values of their other fields.
struct Readable<L>(L);

impl<S, L> Layer<S> for Readable<L>
where
    S: Subscriber,
    L: Layer<S>,
{
    fn on_new_span(
        &self,
        attributes: &span::Attributes<'_>,
        id: &span::Id,
        context: Context<'_, S>,
    ) {
        self.0.on_new_span(attributes, id, context);
    }

    fn on_record(&self, id: &span::Id, values: &span::Record<'_>, context: Context<'_, S>) {
        self.0.on_record(id, values, context);
    }

    fn on_event(&self, event: &Event<'_>, context: Context<'_, S>) {
        let mut text = String::new();
        let written = DefaultFields::new().format_fields(Writer::new(&mut text), event);
        let Some(message) = event
            .metadata()
            .fields()
            .field(MESSAGE)
            .filter(|_| written.is_ok())
        else {
            return self.0.on_event(event, context);
        };
        let mut texts = Texts(vec![(message.clone(), text)]);
        event.record(&mut texts);
        let mut values = [const { None }; MOST_FIELDS];
        for (place, (field, text)) in values.iter_mut().zip(&texts.0) {
            *place = Some((field, text as &dyn Value));
        }
        // A field without a value is left out.
        let values = values.map(|value| match value {
            Some((field, text)) => (field, Some(text)),
            None => (&message, None),
        });
        let values = event.metadata().fields().value_set(&values);
        self.0
            .on_event(&Event::new(event.metadata(), &values), context);
    }
}

/// The fields of an event but for its message, as text.
struct Texts(Vec<(Field, String)>);

impl Texts {
    fn add(&mut self, field: &Field, text: impl FnOnce() -> String) {
        if field.name() != MESSAGE {
            self.0.push((field.clone(), text()));
        }
    }
}

impl Visit for Texts {
    fn record_str(&mut self, field: &Field, value: &str) {
        self.add(field, || value.to_owned());
    }

    fn record_debug(&mut self, field: &Field, value: &dyn std::fmt::Debug) {
        self.add(field, || format!("{value:?}"));
    }
}

#[cfg(test)]
mod tests {
    use std::collections::BTreeMap;
    use std::sync::{Arc, Mutex};

    use tracing_subscriber::layer::SubscriberExt as _;

    use super::*;

    type Entry = BTreeMap<String, String>;

    /// Keeps what would have gone to the journal.
    #[derive(Clone, Default)]
    struct Kept(Arc<Mutex<Vec<Entry>>>);

    struct Fields<'a>(&'a mut Entry);

    impl Visit for Fields<'_> {
        fn record_str(&mut self, field: &Field, value: &str) {
            self.0.insert(field.name().to_owned(), value.to_owned());
        }

        fn record_debug(&mut self, field: &Field, value: &dyn std::fmt::Debug) {
            self.0.insert(field.name().to_owned(), format!("{value:?}"));
        }
    }

    impl<S: Subscriber> Layer<S> for Kept {
        fn on_event(&self, event: &Event<'_>, _: Context<'_, S>) {
            let mut entry = Entry::new();
            event.record(&mut Fields(&mut entry));
            self.0.lock().unwrap().push(entry);
        }
    }

    fn entry(log: impl FnOnce()) -> Entry {
        let kept = Kept::default();
        let subscriber = tracing_subscriber::registry().with(Readable(kept.clone()));
        tracing::subscriber::with_default(subscriber, log);
        let entries = std::mem::take(&mut *kept.0.lock().unwrap());
        let [entry] = entries.try_into().unwrap();
        entry
    }

    fn expected(fields: &[(&str, &str)]) -> Entry {
        let owned = |&(name, value): &(&str, &str)| (name.to_owned(), value.to_owned());
        fields.iter().map(owned).collect()
    }

    #[test]
    fn the_values_of_the_fields_stand_in_the_text_and_stay_fields() {
        let state = "failed";
        let reason = std::io::Error::from(std::io::ErrorKind::NotFound);
        let entry = entry(|| {
            tracing::warn!(scan = %"a-1", state, columns = 7, %reason, "scan {} early", "ended");
        });
        assert_eq!(
            entry,
            expected(&[
                (
                    "message",
                    "scan ended early scan=a-1 state=\"failed\" columns=7 reason=entity not found",
                ),
                ("scan", "a-1"),
                ("state", "failed"),
                ("columns", "7"),
                ("reason", "entity not found"),
            ])
        );
    }

    #[test]
    fn a_text_without_fields_and_fields_without_a_text_stay_as_they_are() {
        assert_eq!(
            entry(|| tracing::info!("reliefd has ended")),
            expected(&[("message", "reliefd has ended")])
        );
        assert_eq!(entry(|| tracing::info!(job = 3)), expected(&[("job", "3")]));
    }
}
