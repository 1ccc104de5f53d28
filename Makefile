# The two commands: `make demo` and `make test`. `make help` lists the rest.
.DEFAULT_GOAL := help
SECONDS := 60
.PHONY: help demo build test fuzz coverage fresh bench lint format clean install-check package

help: ## this list
	@sed -n 's/^\([a-z-]*\):.*## \(.*\)/  make \1\t\2/p' $(MAKEFILE_LIST) | expand -t 24

# What the demo runs: nodes and panel where there is a display; the rest is for `make build`.
DEMO := pf_resampling_generate_messages_py run_bag simulate_bag
DEMO += $(if $(DISPLAY),beacon_mcl_node fastslam_node played_tf_node pf_resampling_rviz_panel)
demo: ## install what is missing, build what it takes, run both filters on simulated drives (BAG=file.bag: on yours, OPTIONS=: of check_bag)
	@scripts/set_up build demo
	@scripts/build --only '$(strip $(DEMO))'
	@scripts/demo $(if $(BAG),'$(BAG)') $(OPTIONS)

build: ## build all but the tests
	@scripts/build

test: ## install what is missing, build, run every test, end with "N passed, N failed" (SANITIZE=..., BUILD_TYPE=Debug)
	@scripts/set_up build test
	@SANITIZE='$(SANITIZE)' BUILD_TYPE='$(BUILD_TYPE)' scripts/test

fuzz: ## build the fuzzers with clang and run each (SECONDS=60: for so long)
	@scripts/set_up build fuzz
	@scripts/fuzz --seconds '$(SECONDS)'

coverage: ## which lines and branches of the core and the pipelines no test runs
	@scripts/set_up build test coverage
	@scripts/coverage --launch

fresh: ## as root: the two commands on a machine made for it that has nothing but git and make
	@scripts/fresh_machine

bench: ## install what is missing, build and run the benchmarks beside MRPT and plain loops (QUICK=yes: for a moment)
	@scripts/set_up build bench
	@scripts/bench $(if $(QUICK),--quick)

lint: ## formatting, catkin_lint, clang-tidy
	@scripts/set_up build test lint
	@scripts/lint

format: ## write all sources in the project's format
	@scripts/set_up lint
	@git ls-files '*.cpp' '*.hpp' | xargs clang-format -i

install-check: ## install into a scratch folder; run programs and build a consumer from there
	@scripts/set_up build
	@scripts/check_install

package: ## as root: build the Debian packages on a clean machine; install them on another and run the demo
	@scripts/check_debian

clean: ## remove what was built
	rm -rf build devel
