# Everything a fresh machine needs is make and one of these; 3.11 goes first, as the image runs on it
# and Blender's own module needs it.
PYTHON ?= python3.11 python3.12 python3.13 python3
VENV := .venv
BIN := $(VENV)/bin
UV_VERSION := 0.13.8
SAMPLE := build/sample/reaching
MODEL := build/models/reaching.onnx
ENV := $(VENV)/.installed

# Without bytecode each of the processes that tests start compiles three thousand modules anew.
unexport PYTHONDONTWRITEBYTECODE

.DEFAULT_GOAL := help

.PHONY: help
help: ## list the targets
	@grep -hE '^[a-z-]+:.*## ' $(MAKEFILE_LIST) | sed -E 's/:.*## /\t/' | expand -t 14

# The lock file decides every version; the stamp makes the install happen once.
$(ENV): pyproject.toml service/pyproject.toml model_export/pyproject.toml uv.lock
	test -x $(BIN)/python || { python=$$(.ci/find-python $(PYTHON)) && "$$python" -m venv $(VENV); }
	$(BIN)/python -m pip install --quiet --disable-pip-version-check uv==$(UV_VERSION)
	UV_PROJECT_ENVIRONMENT=$(VENV) $(BIN)/uv sync --frozen --inexact --all-packages --all-extras --quiet
	@touch $@

.PHONY: install
install: $(ENV) ## install into .venv what the lock file names

# Node comes with the environment; packages are those of the lock file.
NODE := clients/node_modules/.installed
$(NODE): clients/package.json clients/package-lock.json clients/typescript/package.json clients/viewer/package.json clients/runtime/package.json clients/page/package.json | $(ENV)
	PATH="$(CURDIR)/$(BIN):$$PATH" $(BIN)/npm ci --prefix clients --silent --no-audit --no-fund
	@touch $@

.PHONY: node
node: $(NODE) ## install into clients/node_modules what its lock file names

# The service's answer to `/`: one file, made of the page's sources and of nothing else.
PAGE := service/posefield/http/pages/viewer/index.html
$(PAGE): $(NODE) $(shell find clients/viewer/src clients/typescript/src -type f) clients/viewer/index.html clients/viewer/vite.config.ts clients/tsconfig.base.json clients/viewer/tsconfig.json
	PATH="$(CURDIR)/$(BIN):$$PATH" $(BIN)/npm run build --prefix clients/viewer --silent

# Files that `posefield page` copies beside models, for any static host.
MODEL_PAGE := service/posefield/http/pages/model/index.html
$(MODEL_PAGE): $(NODE) $(shell find clients/page/src clients/runtime/src clients/viewer/src -type f) clients/page/index.html clients/page/vite.config.ts clients/tsconfig.base.json
	PATH="$(CURDIR)/$(BIN):$$PATH" $(BIN)/npm run build --prefix clients/page --silent

# The service's answer to `/docs`: Swagger UI as its package holds it, within one file of HTML.
DOCS := service/posefield/http/pages/docs/index.html
SWAGGER := clients/node_modules/swagger-ui-dist
VERSION = $(shell sed -n 's/^__version__ = "\(.*\)"/\1/p' service/posefield/__init__.py)
$(DOCS): $(NODE) clients/docs/index.html service/posefield/__init__.py
	mkdir -p $(@D)
	cat $(addprefix $(SWAGGER)/,LICENSE NOTICE swagger-ui-bundle.js.LICENSE.txt) > $(@D)/LICENSES.txt
	sed -e '/^.. swagger-ui.css/{r $(SWAGGER)/swagger-ui.css' -e 'd}' \
		-e '/^.. swagger-ui-bundle.js/{r $(SWAGGER)/swagger-ui-bundle.js' -e 'd}' \
		-e 's/@VERSION@/$(VERSION)/' clients/docs/index.html > $@

.PHONY: page
page: $(PAGE) $(DOCS) $(MODEL_PAGE) ## build the pages that the service shows, and that of `posefield page`

$(SAMPLE)/recipe.toml: | $(ENV)
	$(BIN)/posefield sample reaching --output $(SAMPLE)

$(MODEL): $(SAMPLE)/recipe.toml | $(ENV)
	$(BIN)/posefield train $(SAMPLE)/recipe.toml --output $(MODEL)

.PHONY: demo
demo: $(MODEL) ## clips of the shipped models, and a reach sampled, trained and served: in build/demo
	$(BIN)/python clients/demo.py $(MODEL) build/demo
	$(BIN)/posefield demo --once --output build/demo

# The shipped models go first, so that the page opens with the walk.
SHIPPED := service/posefield/shipped
.PHONY: run
run: $(MODEL) $(PAGE) $(DOCS) ## serve the shipped models and those of build/models on port 8000
	$(BIN)/posefield serve $(filter-out $(patsubst build/models/%,$(SHIPPED)/%,$(wildcard build/models/*.onnx)),$(wildcard $(SHIPPED)/*.onnx)) build/models

# Motion data of CMU and HDM05, which the recipes name; nothing of it is kept in the project.
POSEFIELD_DATA ?= ../shared/data
SHIPPED_FAMILIES := cmu_walk hdm05_deposit_floor hdm05_deposit_return hdm05_grab_high hdm05_grab_return \
	hdm05_hop hdm05_kick hdm05_kick_return hdm05_sneak hdm05_squat
.PHONY: shipped-models
shipped-models: | $(ENV) ## train the models that ship, from the motion data in POSEFIELD_DATA
	$(BIN)/posefield train $(SHIPPED_FAMILIES) --data $(POSEFIELD_DATA) --output $(SHIPPED)

.PHONY: addon
addon: $(ENV) ## the Blender add-on as an archive to install, in build
	$(BIN)/python clients/blender/archive.py build

# Types are checked beside the tests: neither alone keeps two processors busy.
.PHONY: test
test: $(PAGE) $(DOCS) $(MODEL_PAGE) ## lint, types, layers, unit tests, the contract in process: some minutes
	$(MAKE) --no-print-directory -j2 lint types typescript unit

.PHONY: lint
lint: $(ENV)
	$(BIN)/ruff check .
	$(BIN)/ruff format --check .
	$(BIN)/lint-imports
	$(BIN)/python docs/check_prose.py
	$(MAKE) --no-print-directory docs

# Fails on every warning, and where a generated page differs from its source.
.PHONY: docs
docs: $(ENV) ## build the documentation in build/site
	$(BIN)/python docs/generate.py --check
	$(BIN)/zensical build --config-file mkdocs.yml --strict --clean
	test ! -e $(MODEL_PAGE) || $(BIN)/posefield page $(notdir $(basename $(wildcard $(SHIPPED)/*.onnx))) -o build/site/live

.PHONY: types
types: $(ENV)
	$(BIN)/mypy

.PHONY: typescript
typescript: $(PAGE) ## check types, style and tests of the TypeScript client and the page
	PATH="$(CURDIR)/$(BIN):$$PATH" $(BIN)/npm run check --prefix clients --silent

.PHONY: unit
unit: $(PAGE) $(DOCS) $(MODEL_PAGE)
	$(BIN)/python -m pytest -n auto --dist worksteal -m "not system" --durations=15

.PHONY: test-system
test-system: $(PAGE) $(DOCS) $(MODEL_PAGE) ## all that starts processes: services, exports, stores, clusters, browsers, Blender, the image
	$(BIN)/python -m pytest -n auto --dist worksteal -m system --durations=25
	$(BIN)/python tests/interop/run.py

.PHONY: test-all
test-all: test test-system ## both rings and the older Blender
	$(BIN)/python tests/interop/run.py --others

# 400 MB with their viewers, so that no dependency group of the project has them.
.PHONY: simulators
simulators: | $(ENV) ## record anew what SUMO and JuPedSim say, animate it, and draw the guide's pictures
	$(BIN)/uv run --isolated --no-project --with eclipse-sumo==1.28.0 --with jupedsim==1.4.2 python tests/record_simulators.py
	$(BIN)/python -m pytest -q tests/test_simulators.py
	$(BIN)/python docs/draw_simulators.py

.PHONY: fuzz
fuzz: $(PAGE) $(DOCS) ## send requests drawn from the contract and mutate motion files for half an hour; SECONDS, SEED
	POSEFIELD_FUZZ_SECONDS=$(or $(SECONDS),900) POSEFIELD_FUZZ_SEED=$(or $(SEED),$(shell date +%s)) \
		$(BIN)/python -m pytest -n 2 tests/contract/test_schemathesis.py tests/model_export/test_mutated_files.py -k "drawn or mutated"

# Everything installable: all distributions of the workspace as wheels and sdists.
.PHONY: wheels
wheels: $(PAGE) $(DOCS) $(MODEL_PAGE) ## build wheels and sdists of posefield, posefield-train and posefield-client in dist
	rm -rf dist
	for name in posefield posefield-train posefield-client; do $(BIN)/uv build --quiet --package $$name --out-dir dist; done

.PHONY: audit
audit: $(ENV) ## ask OSV for known vulnerabilities of what the lock file names; fails where it cannot ask
	.ci/audit

.PHONY: bench
bench: $(ENV) ## print the benchmark table and write build/bench.json
	$(BIN)/python benchmarks/bench.py

.PHONY: bench-scale
bench-scale: $(ENV) ## train procedural families of 92 to 2,000 clips, and write the figures and their curve; minutes to half an hour
	OPENBLAS_NUM_THREADS=1 $(BIN)/python benchmarks/scale.py --record
	$(BIN)/python docs/generate.py

.PHONY: lock
lock: $(ENV) ## choose versions anew
	$(BIN)/uv lock --upgrade

.PHONY: clean
clean: ## remove what was built, environments too
	rm -rf build dist .cache service/posefield/http/pages/docs service/posefield/http/pages/viewer service/posefield/http/pages/model clients/node_modules .venv .venv-3.* .venv-blender .venv-blender-older .venv-engines .venv-mink .pytest_cache .mypy_cache .ruff_cache .hypothesis

# Every family is held out take by take; finished folds are kept, so that a run that was stopped goes on.
EVALUATED := cmu_walk hdm05_grab_high hdm05_deposit_floor hdm05_kick hdm05_hop hdm05_squat bandai_raise_hand
EVALUATIONS := build/evaluation/results

.PHONY: evaluate
evaluate: $(SAMPLE)/recipe.toml ## measure all families on held-out clips and write the results pages; DATA: folder of the motion
	test -d "$(DATA)" || { echo "make evaluate needs DATA=folder of the motion data"; exit 2; }
	mkdir -p $(EVALUATIONS)
	for family in $(EVALUATED); do \
		$(BIN)/python benchmarks/evaluate.py $$family --data "$(DATA)" \
			--json $(EVALUATIONS)/$$family.json >/dev/null || exit 1; \
	done
	$(BIN)/python benchmarks/evaluate.py $(SAMPLE)/recipe.toml --json $(EVALUATIONS)/reaching.json >/dev/null
	$(BIN)/python docs/evaluation_summary.py $(EVALUATIONS)
	$(BIN)/python docs/generate.py
