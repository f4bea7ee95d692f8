package model

import (
	"fmt"
	"strings"

	"github.com/anishathalye/porcupine"

	"hypermap-linearizability/history"
)

// The texts of the visualization.

func describeOperation(input, output any) string {
	request, answer := input.(*history.Request), output.(*history.Answer)
	return describeRequest(request) + " -> " + describeAnswer(answer)
}

func describeRequest(request *history.Request) string {
	var text strings.Builder
	switch {
	case !request.IsRead():
		if request.ID != "" {
			fmt.Fprintf(&text, "%s: ", request.ID)
		}
		for i, edit := range request.Edits {
			if i > 0 {
				text.WriteString(", ")
			}
			text.WriteString(describeEdit(edit))
		}
		if request.IfLayer != nil {
			fmt.Fprintf(&text, " if the layer has version %d", *request.IfLayer)
		}
	case request.RPC == history.QueryPoint:
		fmt.Fprintf(&text, "read place %d", request.Place)
	case request.RPC == history.GetMap:
		text.WriteString("read the revision")
	default:
		fmt.Fprintf(&text, "read all (%s)", request.RPC)
	}
	if request.AtRevision != nil {
		fmt.Fprintf(&text, " at r%d", *request.AtRevision)
	}
	if request.MinRevision > 0 {
		fmt.Fprintf(&text, " from r%d on", request.MinRevision)
	}
	return text.String()
}

func describeEdit(edit history.Edit) string {
	condition := ""
	if edit.IfVersion != nil {
		condition = fmt.Sprintf(" if version %d", *edit.IfVersion)
	}
	switch edit.Action {
	case history.Create:
		return fmt.Sprintf("create %d at place %d", edit.Value, edit.Place)
	case history.Delete:
		return fmt.Sprintf("delete #%d%s", edit.ID, condition)
	}
	return fmt.Sprintf("put #%d = %d%s", edit.ID, edit.Value, condition)
}

func describeAnswer(answer *history.Answer) string {
	switch {
	case answer == nil:
		return "?"
	case answer.Status != history.OK:
		return string(answer.Status)
	case len(answer.Objects) > 0:
		return fmt.Sprintf("r%d %s", answer.Revision, describeObjects(answer.Objects))
	case len(answer.ObjectIDs) > 0:
		return fmt.Sprintf("r%d ids %v", answer.Revision, answer.ObjectIDs)
	}
	return fmt.Sprintf("r%d", answer.Revision)
}

func describeObjects(objects []history.Object) string {
	texts := make([]string, len(objects))
	for i, object := range objects {
		texts[i] = fmt.Sprintf("#%d@%d=%d (r%d)", object.ID, object.Place, object.Value, object.Version)
	}
	return strings.Join(texts, " ")
}

func describeState(value any) string {
	s := value.(*state)
	return fmt.Sprintf("r%d %s", s.revision, describeObjects(s.objects))
}

func describeMetadata(value any) string {
	operation, ok := value.(*history.Operation)
	if !ok {
		return ""
	}
	return fmt.Sprintf("client %d, %d attempts", operation.Client, operation.Attempts)
}

// annotationsOf shows what happened to the server.
func annotationsOf(h *history.History) []porcupine.Annotation {
	annotations := make([]porcupine.Annotation, len(h.Events))
	for i, event := range h.Events {
		annotations[i] = porcupine.Annotation{Tag: "server", Start: int64(event.At), Description: event.What}
	}
	return annotations
}
