//! Who may connect: only pages of this server, and with a token only who knows it.
//!
//! A web page from elsewhere, open in the browser of this computer, can send requests to 127.0.0.1 too. Its requests
//! carry its own `Origin`, which is refused (cross-site requests and WebSockets, RFC 6455 section 10.2). If its name is
//! made to point to 127.0.0.1 (DNS rebinding), the `Host` is its name, which is refused: only addresses and `localhost`
//! are taken. With a token a name is taken too, because the browser sends the cookie to the page that got it alone.

use std::net::IpAddr;

use axum::http::{HeaderMap, StatusCode, Uri, header};

/// Fewest characters of a token.
pub(crate) const SHORTEST_TOKEN: usize = 12;
/// Name of the cookie that holds the token.
const COOKIE: &str = "rig_token";

/// Returns true if a token is long enough and needs no escape in an address or a cookie.
pub fn token_is_usable(token: &str) -> bool {
    let plain = |c: char| c.is_ascii_alphanumeric() || "-._~".contains(c);
    token.len() >= SHORTEST_TOKEN && token.chars().all(plain)
}

/// Origins that may read.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Origins {
    /// Pages of this server alone.
    Own,
    /// Programs of this computer and pages that it serves itself, such as a local Lichtblick; with a token any page.
    Local,
}

/// The rule for the requests to one address.
#[derive(Clone, Debug)]
pub(crate) struct Access {
    pub token: Option<String>,
    pub origins: Origins,
}

impl Access {
    /// Checks a request. Without `Origin` it comes from no web page.
    ///
    /// # Errors
    /// The status and the sentence of the refusal.
    pub(crate) fn check(&self, uri: &Uri, headers: &HeaderMap) -> Result<(), (StatusCode, String)> {
        let host = text(headers, header::HOST).unwrap_or_default();
        if self.token.is_none() && !is_local_name(host) {
            return Err((
                StatusCode::FORBIDDEN,
                format!(
                    "The host \"{host}\" is refused: without a token the rig is reached by an address such as 127.0.0.1, or by localhost.\n"
                ),
            ));
        }
        if let Some(origin) = text(headers, header::ORIGIN)
            && !self.takes(origin, host)
        {
            return Err((
                StatusCode::FORBIDDEN,
                format!(
                    "Requests of the page \"{origin}\" are refused: it is not a page of this server.\n"
                ),
            ));
        }
        match &self.token {
            Some(token) if !knows(token, uri, headers) => Err((
                StatusCode::UNAUTHORIZED,
                "This rig asks for its token: open the page with ?token=TEXT behind the address.\n"
                    .to_owned(),
            )),
            _ => Ok(()),
        }
    }

    fn takes(&self, origin: &str, host: &str) -> bool {
        let page = (origin.strip_prefix("http://")).or_else(|| origin.strip_prefix("https://"));
        let own = page == Some(host) && !host.is_empty();
        match self.origins {
            Origins::Own => own,
            Origins::Local => {
                let served_here = page.is_some_and(is_loopback_name);
                own || self.token.is_some() || served_here || origin.starts_with("file://")
            }
        }
    }

    /// Returns the cookie that carries the token on later requests.
    pub(crate) fn cookie(&self) -> Option<String> {
        let token = self.token.as_ref()?;
        Some(format!(
            "{COOKIE}={token}; HttpOnly; SameSite=Strict; Path=/"
        ))
    }
}

fn text(headers: &HeaderMap, name: header::HeaderName) -> Option<&str> {
    headers.get(name).map(|value| value.to_str().unwrap_or("?"))
}

/// Returns the host without its port.
fn name_of(host: &str) -> &str {
    match host.rsplit_once(':') {
        Some((name, port)) if port.bytes().all(|b| b.is_ascii_digit()) => name,
        _ => host,
    }
}

/// Returns the address of a host, with or without a port.
fn address_of(host: &str) -> Option<IpAddr> {
    let name = name_of(host);
    let bare = name.strip_prefix('[').and_then(|n| n.strip_suffix(']'));
    bare.unwrap_or(name).parse().ok()
}

fn is_local_name(host: &str) -> bool {
    name_of(host).eq_ignore_ascii_case("localhost") || address_of(host).is_some()
}

fn is_loopback_name(host: &str) -> bool {
    name_of(host).eq_ignore_ascii_case("localhost")
        || address_of(host).is_some_and(|address| address.is_loopback())
}

/// Returns true if the request carries the token, in its cookie or its query.
fn knows(token: &str, uri: &Uri, headers: &HeaderMap) -> bool {
    let in_query =
        (uri.query().unwrap_or_default().split('&')).filter_map(|pair| pair.strip_prefix("token="));
    let cookies = headers.get_all(header::COOKIE).iter();
    let in_cookie = cookies
        .filter_map(|value| value.to_str().ok())
        .flat_map(|value| value.split(';'))
        .filter_map(|pair| pair.trim().strip_prefix(COOKIE)?.strip_prefix('='));
    in_query
        .chain(in_cookie)
        .fold(false, |known, given| known | equal(given, token))
}

/// Compares in a time that depends on the lengths alone.
fn equal(given: &str, token: &str) -> bool {
    let differ = (given.bytes().zip(token.bytes())).fold(0, |sum, (a, b)| sum | (a ^ b));
    std::hint::black_box(differ) == 0 && given.len() == token.len()
}

#[cfg(test)]
#[allow(clippy::unwrap_used)]
mod tests {
    use super::*;

    fn status(access: &Access, path: &str, pairs: &[(&'static str, &str)]) -> u16 {
        let mut headers = HeaderMap::new();
        for (name, value) in pairs {
            headers.insert(*name, value.parse().unwrap());
        }
        match access.check(&path.parse().unwrap(), &headers) {
            Ok(()) => 200,
            Err((status, _)) => status.as_u16(),
        }
    }

    #[test]
    fn pages_from_elsewhere_are_refused() {
        let open = Access {
            token: None,
            origins: Origins::Own,
        };
        let here = "127.0.0.1:8080";
        assert_eq!(status(&open, "/", &[("host", here)]), 200);
        assert_eq!(status(&open, "/", &[("host", "[::1]:8080")]), 200);
        assert_eq!(status(&open, "/", &[("host", "localhost:1")]), 200);
        let from = |origin| status(&open, "/live", &[("host", here), ("origin", origin)]);
        assert_eq!(from("http://127.0.0.1:8080"), 200);
        // Another server of this computer is another page.
        assert_eq!(from("http://127.0.0.1:8081"), 403);
        assert_eq!(from("https://example.org"), 403);
        assert_eq!(from("null"), 403);
        // A name that was made to point here.
        for name in [
            "example.org:8080",
            "127.0.0.1.example.org",
            "localhost.example.org:80",
            "",
        ] {
            assert_eq!(status(&open, "/", &[("host", name)]), 403, "{name}");
            let origin = format!("http://{name}");
            let both = [("host", name), ("origin", origin.as_str())];
            assert_eq!(status(&open, "/live", &both), 403, "{name}");
        }
    }

    #[test]
    fn a_token_is_needed_on_every_request_and_compared_whole() {
        let token = "abcdefgh-123";
        assert!(token_is_usable(token));
        assert!(!token_is_usable("short") && !token_is_usable("spaces are not ok"));
        let closed = Access {
            token: Some(token.to_owned()),
            origins: Origins::Own,
        };
        let host = ("host", "rig.lab:8080");
        assert_eq!(status(&closed, "/", &[host]), 401);
        assert_eq!(status(&closed, "/?token=abcdefgh-123", &[host]), 200);
        for wrong in ["abcdefgh-12", "abcdefgh-1234", "abcdefgh-124", ""] {
            assert_eq!(status(&closed, &format!("/?token={wrong}"), &[host]), 401);
        }
        let cookie = |text| status(&closed, "/live", &[host, ("cookie", text)]);
        assert_eq!(cookie("a=b; rig_token=abcdefgh-123"), 200);
        assert_eq!(cookie("rig_token=abcdefgh-124"), 401);
        // The token does not make another page one of this server.
        let other = [host, ("origin", "http://example.org")];
        assert_eq!(status(&closed, "/live?token=abcdefgh-123", &other), 403);
    }

    #[test]
    fn readers_of_this_computer_may_read() {
        let mut readers = Access {
            token: None,
            origins: Origins::Local,
        };
        let host = ("host", "127.0.0.1:8765");
        let from = |access: &Access, path: &str, origin: &str| {
            status(access, path, &[host, ("origin", origin)])
        };
        assert_eq!(status(&readers, "/", &[host]), 200);
        assert_eq!(from(&readers, "/", "file://"), 200);
        assert_eq!(from(&readers, "/", "http://localhost:8080"), 200);
        assert_eq!(from(&readers, "/", "https://example.org"), 403);
        assert_eq!(from(&readers, "/", "http://localhost.example.org"), 403);
        readers.token = Some("abcdefgh-123".to_owned());
        assert_eq!(from(&readers, "/", "https://example.org"), 401);
        let path = "/?token=abcdefgh-123";
        assert_eq!(from(&readers, path, "https://example.org"), 200);
    }
}
