"""What browsers are told to do with answers: not to guess what they are, run or frame them.

Answers are data. `X-Frame-Options` is what `frame-ancestors` has replaced; `Referrer-Policy`
matters where there are links. `Strict-Transport-Security` speaks of TLS, which a proxy ends: it is
the proxy's to say.
"""

COMMON = (
    (b"x-content-type-options", b"nosniff"),
    (b"content-security-policy", b"default-src 'none'; frame-ancestors 'none'"),
    # Pages that CORS lets in fetch with it; this is for those that would embed.
    (b"cross-origin-resource-policy", b"same-origin"),
)
"""Headers of every answer that is data."""

PAGES = tuple(pair for pair in COMMON if pair[0] != b"content-security-policy")
"""Headers of every page of our own, which says by itself what it loads: see `page`."""


def of(media_type: str | None, status: int = 200) -> tuple[tuple[bytes, bytes], ...]:
    """Headers of an answer.

    Those of a 304 take the place of those that a browser holds: a policy in it would be that of
    the page from then on, which then loads nothing when it is opened again.
    """
    return PAGES if media_type == "text/html" or status == 304 else COMMON


def page(script: str = "'self'", style: str = "'self'") -> dict[str, str]:
    """Headers of a page of our own, which loads nothing from elsewhere.

    script, style: sources in the words of Content-Security-Policy, as hashes of what stands inline.
    """
    sources = f"default-src 'none'; script-src {script}; style-src {style}; connect-src 'self'"
    more = "img-src 'self' data:; font-src 'self'; base-uri 'none'; form-action 'none'"
    return {
        "Content-Security-Policy": f"{sources}; {more}; frame-ancestors 'none'",
        "Referrer-Policy": "no-referrer",
    }
