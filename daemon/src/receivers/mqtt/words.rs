//! Why a broker does not take messages, in plain words, and what to do about it.

use std::time::Duration;

use rumqttc::{ConnectReturnCode, ConnectionError, StateError, TlsError};

use crate::receivers::words::{of_io, of_tls};

/// Why there is no connection to this broker, or no more.
pub(super) fn told(error: &ConnectionError, broker: &str, timeout: Duration) -> String {
    match error {
        ConnectionError::NetworkTimeout | ConnectionError::FlushTimeout => format!(
            "{broker} did not answer within {} s",
            timeout.as_secs().max(1)
        ),
        ConnectionError::ConnectionRefused(code) => refused(*code, broker),
        ConnectionError::Io(error) | ConnectionError::Tls(TlsError::Io(error)) => {
            of_io(error, broker)
        }
        ConnectionError::Tls(TlsError::TLS(error)) => of_tls(error, broker),
        ConnectionError::MqttState(StateError::Io(error)) => of_io(error, broker),
        ConnectionError::MqttState(StateError::ConnectionAborted) => {
            format!("{broker} closed the connection")
        }
        ConnectionError::MqttState(error) => {
            format!("what {broker} sends cannot be read as MQTT: {error}")
        }
        other => format!("{broker}: {other}"),
    }
}

fn refused(code: ConnectReturnCode, broker: &str) -> String {
    use ConnectReturnCode as C;
    match code {
        C::BadUserNamePassword | C::NotAuthorized => format!(
            "{broker} does not let the service in: see to username and password_file, and to \
             what the broker allows"
        ),
        C::ServiceUnavailable => format!("{broker} takes no connections at present"),
        C::RefusedProtocolVersion => format!("{broker} does not speak MQTT 3.1.1"),
        C::BadClientId => format!("{broker} does not take the name that the service has there"),
        C::Success => format!("{broker} refused the connection"),
    }
}

#[cfg(test)]
mod tests {
    use std::io;

    use super::*;

    #[test]
    fn what_a_broker_refuses_is_told_with_what_to_do() {
        let broker = "lab.example:8883";
        let told = |error: ConnectionError| told(&error, broker, Duration::from_secs(7));
        for code in [
            ConnectReturnCode::BadUserNamePassword,
            ConnectReturnCode::NotAuthorized,
        ] {
            let told = told(ConnectionError::ConnectionRefused(code));
            assert!(told.contains("see to username and password_file"), "{told}");
        }
        let silent = told(ConnectionError::NetworkTimeout);
        assert_eq!(silent, "lab.example:8883 did not answer within 7 s");
        let refused = io::Error::from(io::ErrorKind::ConnectionRefused);
        let refused = told(ConnectionError::Io(refused));
        assert!(refused.contains("is the receiver running?"), "{refused}");
        let unknown = rustls::Error::InvalidCertificate(rustls::CertificateError::UnknownIssuer);
        let unknown = io::Error::new(io::ErrorKind::InvalidData, unknown);
        let unknown = told(ConnectionError::Tls(TlsError::Io(unknown)));
        assert!(unknown.contains("set ca_file"), "{unknown}");
    }
}
