//! Pictures by their address: over http, from public addresses alone.
//!
//! The address that a name has is checked, and it is the one that is connected to. Each redirection is checked
//! likewise.
//!
//! # Reference
//! IANA registries of special-purpose addresses (RFC 6890, 2013).

use super::body::{Limits, receive};
use super::refusal::{NovaRefusal, Refusal};
use axum::body::{Body, Bytes};
use axum::http::{Request, Response, StatusCode, Uri, header};
use hyper::body::Incoming;
use hyper::client::conn::http1;
use hyper_util::rt::TokioIo;
use std::net::{IpAddr, Ipv4Addr, Ipv6Addr, SocketAddr};
use std::time::Duration;
use tokio::net::{TcpStream, lookup_host};
use tokio::time::timeout;

const MAX_REDIRECTIONS: usize = 5;
/// For each step before the picture itself.
const STEP: Duration = Duration::from_secs(10);

/// Fetches the picture at `url`.
///
/// # Errors
/// If the address is not public, or gives no picture in time.
pub(super) async fn fetch(limits: &Limits, url: &str) -> Result<Bytes, NovaRefusal> {
    let mut target = Target::parse(url)?;
    for _ in 0..=MAX_REDIRECTIONS {
        let response = timeout(STEP, target.get()).await;
        let response = response.map_err(|_| refused("the address does not answer in time"))??;
        let status = response.status();
        if status.is_success() {
            let received = receive(limits, response.into_body(), limits.max_bytes).await;
            return received.map_err(of_host);
        }
        if !status.is_redirection() {
            return Err(refused(&format!(
                "the address answers with status {status}"
            )));
        }
        let location = super::http::text_of(response.headers(), header::LOCATION);
        target = target.redirected(location)?;
    }
    Err(refused("the address leads to others again and again"))
}

fn refused(message: &str) -> NovaRefusal {
    NovaRefusal::of_call(message)
}

/// What the host of the address did is no error of the client's request.
fn of_host(refusal: Refusal) -> NovaRefusal {
    match refusal.status {
        StatusCode::SERVICE_UNAVAILABLE => refusal.into(),
        _ => refused(&format!("fetching the address: {}", refusal.message)),
    }
}

/// Where a picture is.
struct Target {
    host: String,
    port: u16,
    path: String,
}

impl Target {
    fn parse(url: &str) -> Result<Self, NovaRefusal> {
        let uri: Uri = url
            .trim()
            .parse()
            .map_err(|_| refused("the address is invalid"))?;
        if uri.scheme_str() != Some("http") {
            return Err(refused(
                "only addresses that begin with http:// are fetched",
            ));
        }
        let host = uri.host().filter(|host| !host.is_empty());
        let host = host.ok_or_else(|| refused("the address names no host"))?;
        let path = uri.path_and_query().map_or("/", |path| path.as_str());
        Ok(Self {
            host: host.to_owned(),
            port: uri.port_u16().unwrap_or(80),
            path: path.to_owned(),
        })
    }

    fn redirected(self, location: &str) -> Result<Self, NovaRefusal> {
        if location.starts_with('/') && !location.starts_with("//") {
            let path = location.to_owned();
            return Ok(Self { path, ..self });
        }
        Self::parse(location)
    }

    /// The public address of the host.
    async fn address(&self) -> Result<SocketAddr, NovaRefusal> {
        let host = self.host.trim_start_matches('[').trim_end_matches(']');
        let found = lookup_host((host, self.port)).await;
        let found: Vec<SocketAddr> = found
            .map_err(|_| refused("the host of the address is unknown"))?
            .collect();
        // A name with a public address and a private one is not to be trusted.
        match found.iter().all(|address| is_public(address.ip())) {
            true => found
                .first()
                .copied()
                .ok_or_else(|| refused("the host has no address")),
            false => Err(refused("the address is not public")),
        }
    }

    async fn get(&self) -> Result<Response<Incoming>, NovaRefusal> {
        let address = self.address().await?;
        tracing::info!(host = self.host, %address, "fetching");
        let failed = |_| refused("the host of the address does not answer");
        let stream = TcpStream::connect(address).await.map_err(failed)?;
        let failed = |_| refused("the host of the address does not speak http");
        let (mut sender, connection) = http1::handshake(TokioIo::new(stream))
            .await
            .map_err(failed)?;
        // It ends with the answer's body.
        tokio::spawn(connection);
        let request = Request::get(&self.path)
            .header(header::HOST, format!("{}:{}", self.host, self.port))
            .header(header::USER_AGENT, "starpipe")
            .header(header::CONNECTION, "close")
            .body(Body::empty());
        let request = request.map_err(|_| refused("the address is invalid"))?;
        sender.send_request(request).await.map_err(failed)
    }
}

/// Whether an address is reached over the Internet, and not within a computer or a network.
fn is_public(address: IpAddr) -> bool {
    match address {
        IpAddr::V4(address) => is_public_v4(address),
        IpAddr::V6(address) => is_public_v6(address),
    }
}

fn is_public_v4(address: Ipv4Addr) -> bool {
    let [a, b, c, _] = address.octets();
    let is_special = address.is_private()
        || address.is_loopback()
        || address.is_link_local()
        || address.is_documentation()
        || a == 0
        || (a == 100 && (64..128).contains(&b))
        || (a == 192 && b == 0 && c == 0)
        || (a == 192 && b == 88 && c == 99)
        || (a == 198 && (18..20).contains(&b))
        || a >= 224;
    !is_special
}

/// Only 2000::/3 is given to hosts; parts of it stand for other networks, or for IPv4.
fn is_public_v6(address: Ipv6Addr) -> bool {
    let [first, second, ..] = address.segments();
    let is_given = first & 0xe000 == 0x2000;
    let is_special = (first == 0x2001 && (second < 0x200 || second == 0xdb8))
        || first == 0x2002
        || (first == 0x3fff && second < 0x1000);
    is_given && !is_special
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn addresses_within_networks_are_not_public() {
        for address in [
            "127.0.0.1",
            "127.9.9.9",
            "10.1.2.3",
            "172.16.0.1",
            "192.168.1.1",
            "169.254.169.254",
            "0.0.0.0",
            "100.64.0.1",
            "192.0.0.8",
            "192.0.2.1",
            "198.18.0.1",
            "224.0.0.1",
            "255.255.255.255",
            "240.0.0.1",
            "::",
            "::1",
            "::ffff:127.0.0.1",
            "::ffff:8.8.8.8",
            "fe80::1",
            "fc00::1",
            "fd12::1",
            "ff02::1",
            "64:ff9b::7f00:1",
            "2001:db8::1",
            "2002:7f00:1::",
            "2001::1",
            "fec0::1",
        ] {
            assert!(!is_public(address.parse().unwrap()), "{address}");
        }
        for address in [
            "8.8.8.8",
            "100.128.0.1",
            "172.32.0.1",
            "2600::1",
            "2a00:1450::1",
        ] {
            assert!(is_public(address.parse().unwrap()), "{address}");
        }
    }

    #[test]
    fn a_slow_host_is_an_error_of_the_protocol_and_a_full_server_is_not() {
        let slow = Refusal::new(StatusCode::REQUEST_TIMEOUT, "the body arrives too slowly");
        let NovaRefusal(told) = of_host(slow);
        assert_eq!(told.status, StatusCode::OK);
        assert_eq!(
            told.message,
            "fetching the address: the body arrives too slowly"
        );
        let NovaRefusal(told) = of_host(Refusal::busy("full"));
        assert_eq!(told.status, StatusCode::SERVICE_UNAVAILABLE);
    }

    #[test]
    fn only_http_is_fetched_and_redirections_stay_within_it() {
        for url in [
            "https://a/b.png",
            "file:///etc/passwd",
            "/etc/passwd",
            "ftp://a",
            "",
            "http://",
        ] {
            assert!(Target::parse(url).is_err(), "{url}");
        }
        let target = || Target::parse("http://user@a.example:81/b?c").unwrap_or_else(|_| panic!());
        assert_eq!(
            (&*target().host, target().port, &*target().path),
            ("a.example", 81, "/b?c")
        );
        let moved = target().redirected("/d").unwrap_or_else(|_| panic!());
        assert_eq!((&*moved.host, &*moved.path), ("a.example", "/d"));
        let moved = target()
            .redirected("http://[::1]/")
            .unwrap_or_else(|_| panic!());
        assert_eq!((&*moved.host, moved.port), ("[::1]", 80));
        for location in ["//b/c", "https://b/", "c", ""] {
            assert!(target().redirected(location).is_err(), "{location}");
        }
    }
}
