"""The dashboard, the alerts and the manual ask for metrics and labels that the server has."""

import json
import pathlib
import re
import unittest

import yaml

ROOT = pathlib.Path(__file__).resolve().parents[2]
METRICS = ROOT / "server" / "metrics"
DASHBOARD = ROOT / "deploy" / "grafana" / "hypermap.json"
GRAFANA = ROOT / "deploy" / "grafana" / "provisioning"
RULES = ROOT / "deploy" / "prometheus" / "hypermap.rules.yml"
MANUAL = ROOT / "docs" / "operations.md"

NAME = r"(?:grpc_server|hypermap|process)_\w+"
# What Prometheus itself adds.
OWN_METRICS = {"up"}
OWN_LABELS = {"instance", "job", "le"}
KEYWORDS = {"and", "bool", "by", "ignoring", "on", "or", "unless", "without"}


def without_comments(text):
    return re.sub(r"//.*", "", text)


def sources():
    return [without_comments(path.read_text()) for path in METRICS.glob("*.cc")
            if not path.name.endswith("_test.cc")]


def served_metrics():
    """Returns the names under which Prometheus stores what the server tells."""
    names = set(OWN_METRICS)
    for text in sources():
        # The type of a metric is given after its name and before the next one; gauges of one helper
        # have none.
        for name, rest in re.findall(rf'"({NAME})"((?:(?!"{NAME}").)*)', text, re.DOTALL):
            kind = re.search(r"MetricType::(\w+)", rest)
            if kind and kind[1] == "Histogram":
                names |= {f"{name}_bucket", f"{name}_count", f"{name}_sum"}
            else:
                names.add(name)
    return names


def served_labels():
    return OWN_LABELS | {label for text in sources() for label in re.findall(r'\{"(\w+)", ', text)}


def names_in(query):
    """Returns the metrics and the labels that a query of PromQL names."""
    labels = set()
    for matchers in re.findall(r"\{([^}]*)\}", query):
        labels |= set(re.findall(r"(\w+)\s*(?:=~|!~|!=|=)", matchers))
    rest = re.sub(r"\{[^}]*\}|\[[^\]]*\]", "", query)
    grouping = r"\b(?:by|without|on|ignoring)\s*\(([^)]*)\)"
    for group in re.findall(grouping, rest):
        labels |= set(re.findall(r"\w+", group))
    rest = re.sub(grouping, "", rest)
    # Functions are followed by a parenthesis, numbers begin with a digit.
    metrics = set(re.findall(r"\b[a-z]\w*\b(?!\s*\()", rest)) - KEYWORDS
    return metrics, labels


class Queries(unittest.TestCase):

    @classmethod
    def setUpClass(cls):
        cls.metrics = served_metrics()
        cls.labels = served_labels()
        cls.dashboard = json.loads(DASHBOARD.read_text())
        cls.rules = [rule for group in yaml.safe_load(RULES.read_text())["groups"]
                     for rule in group["rules"]]

    def check(self, query):
        metrics, labels = names_in(query)
        self.assertTrue(metrics, query)
        self.assertLessEqual(metrics, self.metrics, query)
        self.assertLessEqual(labels, self.labels, query)

    def test_the_names_of_a_query_are_found(self):
        self.assertEqual(
            names_in('sum by (a, le) (rate(x_total{b="1", c=~"$c"}[5m])) / on (d) y > 0.5'
                     " or vector(0)"),
            ({"x_total", "y"}, {"a", "b", "c", "d", "le"}))

    def test_the_server_has_metrics(self):
        self.assertGreater(len(self.metrics), 30)
        self.assertIn("grpc_server_handling_seconds_bucket", self.metrics)
        self.assertIn("hypermap_map_up", self.metrics)
        self.assertIn("hypermap_memory_limit_bytes", self.metrics)
        self.assertNotIn("hypermap_map_group_commits", self.metrics)

    def test_queries_of_the_dashboard(self):
        for panel in self.dashboard["panels"]:
            for target in panel["targets"]:
                with self.subTest(panel=panel["title"]):
                    self.check(target["expr"])

    def test_variables_of_the_dashboard(self):
        for variable in self.dashboard["templating"]["list"]:
            with self.subTest(variable=variable["name"]):
                query = re.fullmatch(r"label_values\((\w+), (\w+)\)", variable["query"])
                metric, label = query.groups()
                self.assertIn(metric, self.metrics)
                self.assertIn(label, self.labels)

    def test_legends_name_labels_of_their_queries(self):
        for panel in self.dashboard["panels"]:
            for target in panel["targets"]:
                named = set(re.findall(r"\{\{(\w+)\}\}", target["legendFormat"]))
                with self.subTest(panel=panel["title"]):
                    self.assertLessEqual(named, names_in(target["expr"])[1])

    def test_panels_do_not_overlap(self):
        taken = {}
        for panel in self.dashboard["panels"]:
            at = panel["gridPos"]
            self.assertLessEqual(at["x"] + at["w"], 24, panel["title"])
            for x in range(at["x"], at["x"] + at["w"]):
                for y in range(at["y"], at["y"] + at["h"]):
                    self.assertNotIn((x, y), taken, panel["title"])
                    taken[x, y] = panel["title"]
        ids = [panel["id"] for panel in self.dashboard["panels"]]
        self.assertEqual(len(ids), len(set(ids)))

    def test_the_data_source_is_provisioned(self):
        found = yaml.safe_load((GRAFANA / "datasources" / "prometheus.yml").read_text())
        uids = {source["uid"] for source in found["datasources"]}
        self.assertLessEqual(
            set(re.findall(r'"type": "prometheus", "uid": "(\w+)"', DASHBOARD.read_text())), uids)

    def test_queries_of_the_alerts(self):
        for rule in self.rules:
            with self.subTest(alert=rule["alert"]):
                self.check(rule["expr"])

    def test_the_manual_has_every_alert(self):
        in_manual = set(re.findall(r"^\| (Hypermap\w+) \|", MANUAL.read_text(), re.MULTILINE))
        self.assertEqual(in_manual, {rule["alert"] for rule in self.rules})

    def test_metrics_of_the_manual(self):
        named = set(re.findall(rf"\b{NAME}\b", MANUAL.read_text()))
        self.assertLessEqual(named - {"hypermap_metadata"}, self.metrics)  # without a table


if __name__ == "__main__":
    unittest.main()
