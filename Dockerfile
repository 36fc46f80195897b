# The service and its commands: nothing of the training job, nothing that builds.
# The index of all platforms of Python 3.11.17; a newer one: docker buildx imagetools inspect python:3.11-slim-bookworm
ARG BASE=docker.io/library/python:3.11-slim-bookworm@sha256:0a310eeecf4e1f5a0743f9a6520c90c88d089c903ca5fd283f501e3a805f5f89
FROM ${BASE} AS build
ENV UV_COMPILE_BYTECODE=1 \
    UV_LINK_MODE=copy \
    UV_PROJECT_ENVIRONMENT=/opt/posefield \
    UV_PYTHON_DOWNLOADS=never
# Debian keeps one version of a package: there is none to name.
# hadolint ignore=DL3008
RUN apt-get update && \
    apt-get install --yes --no-install-recommends binutils && \
    rm -rf /var/lib/apt/lists/*
RUN pip install --no-cache-dir uv==0.13.8
# Object stores are 16 MB, Dask another 18, tokens (jwt) 15, traces (trace) 5, Parquet 170:
# --build-arg EXTRAS="--extra store --extra jwt".
ARG EXTRAS="--extra store"
WORKDIR /src
# Dependencies change seldom, the service often: they get a layer of their own.
COPY pyproject.toml uv.lock ./
COPY service/pyproject.toml service/
COPY model_export/pyproject.toml model_export/
COPY clients/python/pyproject.toml clients/python/
# hadolint ignore=SC2086
RUN uv sync --frozen --no-dev --package posefield --no-install-workspace ${EXTRAS}
# A third of USD's wheel is symbols. Not everywhere: stripped, OpenBLAS of NumPy's does not load any more.
# What follows are the wheels' own tests, and tools that make models.
WORKDIR /opt/posefield/lib/python3.11/site-packages
RUN find pxr usd_core.libs -name '*.so*' -type f -exec strip --strip-unneeded {} + && \
    find . -type d -name tests -prune -exec rm -r {} + && \
    rm -r onnxruntime/quantization onnxruntime/tools onnxruntime/transformers
WORKDIR /src
# service/posefield/http/api/openapi.yaml is a link into api/.
COPY api api
COPY service service
# `make page` builds them, once for every machine: the image needs no Node.
# hadolint ignore=SC2086
RUN { test -f service/posefield/http/pages/viewer/index.html && test -f service/posefield/http/pages/docs/index.html || { echo "no page: run make page first" >&2; exit 1; }; } && \
    uv sync --frozen --no-dev --package posefield --no-editable ${EXTRAS}
# What is in it, by what is installed: /opt/posefield/share/sbom.cdx.json (CycloneDX).
RUN mkdir -p /opt/posefield/share && uv run --frozen --isolated --only-group sbom cyclonedx-py environment --pyproject service/pyproject.toml --output-reproducible --output-file /opt/posefield/share/sbom.cdx.json /opt/posefield/bin/python

FROM ${BASE}
ARG SOURCE=""
ARG REVISION=""
LABEL org.opencontainers.image.title="posefield" \
      org.opencontainers.image.description="Control parameters and a time in, poses and clips out." \
      org.opencontainers.image.version="0.3.0" \
      org.opencontainers.image.licenses="Apache-2.0 AND CC-BY-SA-3.0" \
      org.opencontainers.image.base.name="docker.io/library/python:3.11-slim-bookworm" \
      org.opencontainers.image.base.digest="sha256:0a310eeecf4e1f5a0743f9a6520c90c88d089c903ca5fd283f501e3a805f5f89" \
      org.opencontainers.image.source="${SOURCE}" \
      org.opencontainers.image.revision="${REVISION}"
# Bytecode is compiled above; the root may be read-only. onnxruntime reports to its vendor unless told not to.
# It listens for everybody, and so starts only with keys (POSEFIELD_KEYS_FILE, ...) or with POSEFIELD_OPEN=1.
ENV PATH=/opt/posefield/bin:$PATH \
    PYTHONDONTWRITEBYTECODE=1 \
    PYTHONUNBUFFERED=1 \
    ORT_DISABLE_TELEMETRY=1 \
    POSEFIELD_HOST=0.0.0.0 \
    POSEFIELD_PORT=8000
COPY --from=build /opt/posefield /opt/posefield
USER 10001:10001
EXPOSE 8000
HEALTHCHECK --interval=10s --timeout=3s --start-period=20s CMD ["python", "-c", "import os, urllib.request; urllib.request.urlopen('http://127.0.0.1:' + os.environ['POSEFIELD_PORT'] + '/readyz', timeout=2)"]
ENTRYPOINT ["posefield", "serve"]
CMD ["/models"]
