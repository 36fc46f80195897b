# Everything a fresh machine needs is Python 3.11 and make.
PYTHON ?= python3.11
VENV := .venv
BIN := $(VENV)/bin
UV_VERSION := 0.13.8
SAMPLE := build/sample/reaching
MODEL := build/models/reaching.onnx
ENV := $(VENV)/.installed

.DEFAULT_GOAL := help

.PHONY: help
help: ## list the targets
	@grep -hE '^[a-z]+:.*## ' $(MAKEFILE_LIST) | sed -E 's/:.*## /\t/' | expand -t 12

# The lock file decides every version; the stamp makes the install happen once.
$(ENV): pyproject.toml uv.lock
	test -x $(BIN)/python || $(PYTHON) -m venv $(VENV)
	$(BIN)/python -m pip install --quiet --disable-pip-version-check uv==$(UV_VERSION)
	UV_PROJECT_ENVIRONMENT=$(VENV) $(BIN)/uv sync --frozen --inexact --all-extras --quiet
	@touch $@

.PHONY: install
install: $(ENV) ## install into .venv what the lock file names

# Node comes with the environment; packages are those of the lock file.
NODE := clients/node_modules/.installed
$(NODE): clients/package.json clients/package-lock.json clients/typescript/package.json clients/viewer/package.json | $(ENV)
	PATH="$(CURDIR)/$(BIN):$$PATH" $(BIN)/npm ci --prefix clients --silent --no-audit --no-fund
	@touch $@

.PHONY: node
node: $(NODE) ## install into clients/node_modules what its lock file names

# What the service answers `/` with: one file, made of the page's sources and of nothing else; and what
# `posefield page` lays beside it for hosts without a service.
PAGE := service/web/viewer/index.html
$(PAGE): $(NODE) $(shell find clients/viewer/src clients/typescript/src -type f) clients/viewer/index.html clients/viewer/vite.config.ts clients/viewer/vite.offline.ts clients/tsconfig.base.json clients/viewer/tsconfig.json
	PATH="$(CURDIR)/$(BIN):$$PATH" $(BIN)/npm run build --prefix clients/viewer --silent

.PHONY: page
page: $(PAGE) ## build the page that the service shows at /

$(SAMPLE)/recipe.toml: | $(ENV)
	$(BIN)/posefield sample reaching --output $(SAMPLE)

$(MODEL): $(SAMPLE)/recipe.toml | $(ENV)
	$(BIN)/posefield train $(SAMPLE)/recipe.toml --output $(MODEL)

.PHONY: demo
demo: $(MODEL) ## sample, train, serve, ask over HTTP: clips in build/demo
	$(BIN)/python clients/demo.py $(MODEL) build/demo

.PHONY: run
run: $(MODEL) $(PAGE) ## the same, but the service stays up on port 8000
	$(BIN)/posefield serve build/models

.PHONY: addon
addon: $(ENV) ## the Blender add-on as an archive to install, in build
	$(BIN)/python clients/blender/archive.py build

.PHONY: test
test: $(PAGE) ## lint, types, layers and all tests (no Blender, no browser)
	$(BIN)/ruff check .
	$(BIN)/ruff format --check .
	$(BIN)/mypy
	$(BIN)/python -m pytest -n auto

.PHONY: interop
interop: $(PAGE) ## other readers of our files, other engines of a model, the image really built
	$(BIN)/python tests/interop/run.py

.PHONY: audit
audit: $(ENV) ## ask OSV for known vulnerabilities of what the lock file names
	.ci/audit

.PHONY: bench
bench: $(ENV) ## print the benchmark table and write build/bench.json
	$(BIN)/python benchmarks/bench.py

.PHONY: lock
lock: $(ENV) ## choose versions anew
	$(BIN)/uv lock --upgrade

.PHONY: clean
clean: ## remove what was built, environments too
	rm -rf build dist service/web/viewer service/web/offline clients/node_modules .venv .venv-blender .venv-blender-5 .venv-engines .pytest_cache .mypy_cache .ruff_cache .hypothesis
