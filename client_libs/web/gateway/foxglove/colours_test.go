package foxglove

import (
	"encoding/json"
	"os"
	"testing"
)

// The dashboard and hypermap-ros2 read the same table in their tests.
func TestClassesHaveTheColoursOfTheDashboard(t *testing.T) {
	text, err := os.ReadFile("../../../testing/class_colours.json")
	if err != nil {
		t.Fatal(err)
	}
	var colours map[string][3]uint8
	if err := json.Unmarshal(text, &colours); err != nil {
		t.Fatal(err)
	}
	for label, want := range colours {
		if got := classColour(label); got != (rgba{want[0], want[1], want[2], 255}) {
			t.Errorf("%q has the colour %v instead of %v", label, got, want)
		}
	}
}
