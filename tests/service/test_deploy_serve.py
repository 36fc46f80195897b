"""Tests of the service's manifests: valid for Kubernetes, and mutually consistent."""

import re
from dataclasses import fields
from pathlib import Path

import kubernetes_validate
import pytest
import yaml

import posefield
from posefield.common.errors import InvalidField
from posefield.http import request
from posefield.http.access import access_control, api_keys
from posefield.http.api import settings
from posefield.http.api.problems import RequestError
from posefield.http.api.settings import PREFIX, Settings

DEPLOY = Path(__file__).parents[2] / "service/deploy"
ROOT = Path(__file__).parents[2]
KUBERNETES = "1.37"
KINDS = (
    "ServiceAccount",
    "Deployment",
    "Service",
    "HorizontalPodAutoscaler",
    "PodDisruptionBudget",
    "NetworkPolicy",
)


@pytest.fixture
def objects():
    """Every object by its kind."""
    found = list(yaml.safe_load_all((DEPLOY / "serve.yaml").read_text()))
    assert [each["kind"] for each in found] == list(KINDS)
    return {each["kind"]: each for each in found}


@pytest.fixture
def pod(objects):
    return objects["Deployment"]["spec"]["template"]


@pytest.fixture
def container(pod):
    (own,) = pod["spec"]["containers"]
    return own


def environment(container):
    return {each["name"]: each["value"] for each in container["env"]}


def assert_valid(manifest):
    kubernetes_validate.validate(manifest, KUBERNETES, strict=True)


@pytest.mark.parametrize("kind", KINDS)
def test_kubernetes_knows_every_field(kind, objects):
    assert_valid(objects[kind])


def test_the_port_is_one(objects, container):
    (port,) = container["ports"]
    assert str(port["containerPort"]) == environment(container)["POSEFIELD_PORT"]
    exposed = re.search(r"^EXPOSE (\d+)$", (ROOT / "Dockerfile").read_text(), re.MULTILINE)
    assert exposed and int(exposed[1]) == port["containerPort"]
    probes = [container[f"{name}Probe"]["httpGet"] for name in ("startup", "readiness", "liveness")]
    (service_port,) = objects["Service"]["spec"]["ports"]
    (rule,) = objects["NetworkPolicy"]["spec"]["ingress"]
    named = [*(probe["port"] for probe in probes), service_port["targetPort"]]
    assert {*named, *(each["port"] for each in rule["ports"])} == {port["name"]}


def test_variables_are_settings(container):
    known = {PREFIX + each.name.upper() for each in fields(Settings)}
    assert set(environment(container)) <= known
    assert f"{PREFIX}GRACE_PERIOD" not in known


def test_a_pod_that_goes_has_the_time_it_needs(pod, container):
    drain, grace = (int(environment(container)[f"POSEFIELD_{n}"]) for n in ("DRAIN", "GRACE"))
    # Endpoints are forgotten everywhere within some seconds.
    assert drain >= 5
    assert pod["spec"]["terminationGracePeriodSeconds"] >= drain + grace + 5


def test_it_starts_with_these_settings_and_not_without_keys(container, tmp_path):
    """As the service itself checks them before it listens; the address is the image's."""
    mounted = tmp_path / "keys"
    mounted.write_text(api_keys.key_line("blender", ["read:*"], api_keys.generate_key()) + "\n")
    given = environment(container) | {"POSEFIELD_HOST": "0.0.0.0"}
    assert given["POSEFIELD_KEYS_FILE"] == "/keys/keys"
    given["POSEFIELD_KEYS_FILE"] = str(mounted)
    own = settings.read_settings(environ=given)
    access_control.from_settings(own)
    # Negative control.
    del given["POSEFIELD_KEYS_FILE"]
    open_to_all = settings.read_settings(environ=given)
    with pytest.raises(InvalidField, match="POSEFIELD_KEYS_FILE"):
        access_control.from_settings(open_to_all)


@pytest.mark.parametrize(
    "host", ["posefield", "posefield.default", "posefield.b.svc.cluster.local:80", "10.1.2.3:8000"]
)
def test_pods_may_use_the_names_of_the_service(host, objects, container):
    name = objects["Service"]["metadata"]["name"]
    assert host.startswith((name, "10."))
    known = request.host_names(environment(container)["POSEFIELD_HOSTS"], "POSEFIELD_HOSTS")
    limits = request.HeadLimits(100, 1000, known)
    scope = {"raw_path": b"/", "query_string": b"", "http_version": "1.1"}
    limits.check(scope | {"headers": [(b"host", host.encode())]})
    # Negative control.
    with pytest.raises(RequestError):
        limits.check(scope | {"headers": [(b"host", b"evil.example")]})


def test_a_pod_may_do_little(pod, container):
    user = re.search(r"^USER (\d+):(\d+)$", (ROOT / "Dockerfile").read_text(), re.MULTILINE)
    context, own = pod["spec"]["securityContext"], container["securityContext"]
    assert user and [context["runAsUser"], context["runAsGroup"]] == [int(n) for n in user.groups()]
    assert context["runAsNonRoot"] and context["seccompProfile"] == {"type": "RuntimeDefault"}
    assert own["readOnlyRootFilesystem"] and not own["allowPrivilegeEscalation"]
    assert own["capabilities"] == {"drop": ["ALL"]}
    assert pod["spec"]["automountServiceAccountToken"] is False
    mounts = {each["mountPath"]: each.get("readOnly", False) for each in container["volumeMounts"]}
    assert mounts == {"/models": True, "/keys": True, "/tmp": False}
    assert container["args"] == ["/models"]
    volumes = {volume["name"] for volume in pod["spec"]["volumes"]}
    assert {each["name"] for each in container["volumeMounts"]} == volumes


def test_the_image_is_of_this_version(pod, container):
    assert container["image"] == f"posefield:{posefield.__version__}"
    assert pod["metadata"]["labels"]["app.kubernetes.io/version"] == posefield.__version__
    assert container["resources"]["requests"].keys() == {"cpu", "memory"}
