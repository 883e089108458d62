# `make reproduce` and `make test` each work alone on a machine with Python 3.10 or 3.11, make and nothing else.
#   make reproduce [EPISODES=N] [JOBS=J] [OUT=DIR]    Table 1; an interrupted run goes on where it stopped
#   make test [JOBS=J]
#   make setup [PYTHON=/path/to/python3.11]           .venv only

PYTHON ?= python3.11 python3.10 python3
JOBS ?= $(shell nproc 2>/dev/null || getconf _NPROCESSORS_ONLN)
OUT ?= results/reproduced$(if $(EPISODES),-$(EPISODES))
READY := .venv/.setup-done
PIP := .venv/bin/python -m pip install -qq -c constraints.txt

# An environment whose interpreter has gone (upgraded, removed) counts as not made.
_ := $(shell .venv/bin/python -c '' 2>/dev/null || rm -f $(READY))

.PHONY: setup reproduce test lint clean

setup: $(READY)

reproduce: $(READY)
	.venv/bin/follow reproduce table1 --resume --jobs $(JOBS) --out $(OUT)$(if $(EPISODES), --episodes $(EPISODES))

test: $(READY)
	.venv/bin/python -m pytest -n $(JOBS) --maxprocesses 8 --dist worksteal

lint: $(READY)
	.venv/bin/ruff check
	.venv/bin/ruff format --check
	.venv/bin/mypy

clean:
	rm -rf .venv build dist *.egg-info .pytest_cache .mypy_cache .ruff_cache
	find . -name __pycache__ -type d -prune -exec rm -rf {} +

# The stamp is written last and removed before anything changes: an interrupted set-up starts again from nothing, while
# new requirements are installed into the environment that is there. ensurepip is what Debian splits from its Python.
$(READY): pyproject.toml constraints.txt
	@if [ ! -e $@ ]; then found=; \
	    for python in $(PYTHON); do \
	        version=$$("$$python" -c 'import ensurepip, sys; print("%d.%d" % sys.version_info[:2])' 2>/dev/null); \
	        case "$$version" in \
	            3.10|3.11) break ;; \
	            '') found="$$found$${found:+, }$$python does not run or lacks venv" ;; \
	            *) found="$$found$${found:+, }$$python is Python $$version" ;; \
	        esac; \
	        version=; \
	    done; \
	    if [ -z "$$version" ]; then \
	        echo "follow-env needs Python 3.10 or 3.11 with venv, but $$found:" \
	            "name one that fits, as in \`make setup PYTHON=/path/to/python3.11\`." >&2; \
	        exit 1; \
	    fi; \
	    echo "setting up .venv with Python $$version, about 2 minutes (longer if the network is slow)"; \
	    rm -rf .venv && "$$python" -m venv .venv; \
	else \
	    echo "updating .venv to the new requirements"; \
	    rm -f $@; \
	fi
	@$(PIP) setuptools && $(PIP) --no-build-isolation -e '.[test,dev]' || { \
	    echo "could not install what constraints.txt names: see above, check the network, and run make again." >&2; \
	    exit 1; \
	}
	@touch $@
