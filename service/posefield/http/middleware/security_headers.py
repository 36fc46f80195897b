"""Security headers for browsers: no content sniffing, no scripts, no framing.

`X-Frame-Options` is omitted since `frame-ancestors` replaces it. Only pages need `Referrer-Policy`,
since data has no links. The proxy that terminates TLS sets `Strict-Transport-Security`.
"""

COMMON = (
    (b"x-content-type-options", b"nosniff"),
    (b"content-security-policy", b"default-src 'none'; frame-ancestors 'none'"),
    # Concerns embedding without CORS; it does not block requests that CORS allows.
    (b"cross-origin-resource-policy", b"same-origin"),
)
"""Headers of data responses."""

PAGES = tuple(pair for pair in COMMON if pair[0] != b"content-security-policy")
"""Headers of HTML pages; `page_headers` returns their own Content-Security-Policy."""


def headers_for(media_type: str | None, status: int = 200) -> tuple[tuple[bytes, bytes], ...]:
    """Return the security headers of a response.

    A 304 has no Content-Security-Policy: it would replace that of the browser's cached page, which
    could then load nothing.
    """
    return PAGES if media_type == "text/html" or status == 304 else COMMON


def page_headers(script: str, style: str) -> dict[str, str]:
    """Return the headers of an HTML page that loads nothing from other origins.

    script, style: sources of a Content-Security-Policy.
    """
    sources = f"default-src 'none'; script-src {script}; style-src {style}; connect-src 'self'"
    # Workers come from the page itself, which reads motion files in them.
    workers = "worker-src blob:"
    more = "img-src 'self' data:; font-src 'self'; base-uri 'none'; form-action 'none'"
    return {
        "Content-Security-Policy": f"{sources}; {workers}; {more}; frame-ancestors 'none'",
        "Referrer-Policy": "no-referrer",
    }
