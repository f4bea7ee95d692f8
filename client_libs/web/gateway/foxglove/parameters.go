package foxglove

import (
	"context"
	"errors"
	"fmt"
	"math"
	"slices"
	"time"

	"google.golang.org/protobuf/types/known/timestamppb"

	pb "hypermap-gateway/gen/hypermapv1"
	"hypermap-gateway/mapserver"
)

// The parameters of a connection. Clients set the first two to see the past.
const (
	// Revision to show, 0 for the newest.
	asOfRevisionParameter = "as_of_revision"
	// Time to show, as in RFC 3339, or "" for the newest.
	asOfTimeParameter = "as_of_time"
	// The newest revision of the map. Can't be set.
	revisionParameter = "revision"
)

var allParameters = []string{asOfRevisionParameter, asOfTimeParameter, revisionParameter}

// parameterNames returns those of the names that are parameters; none means all.
func parameterNames(names []string) []string {
	if len(names) == 0 {
		return allParameters
	}
	return slices.DeleteFunc(slices.Clone(allParameters), func(known string) bool { return !slices.Contains(names, known) })
}

// asOf selects the revision that is shown. The zero value selects the newest.
type asOf struct {
	// The past revision in a question to the server, or nil.
	selected *pb.AsOf
	revision int64
	// The time that the client asked for, if it asked for a time.
	time string
}

func (a asOf) isPast() bool { return a.selected != nil }

func (s *session) valueOf(name string) any {
	switch name {
	case asOfRevisionParameter:
		if s.asOf.time != "" {
			return 0
		}
		return s.asOf.revision
	case asOfTimeParameter:
		return s.asOf.time
	}
	return s.revision
}

// tellParameters sends the values of parameters. No names mean all.
func (s *session) tellParameters(ctx context.Context, names []string, id string) error {
	message := parameterValues{Op: "parameterValues", Parameters: []parameter{}, ID: id}
	for _, name := range parameterNames(names) {
		message.Parameters = append(message.Parameters, parameter{name, s.valueOf(name)})
	}
	return s.send(ctx, message)
}

// tellRevision tells the newest revision to a client that wants to know it.
func (s *session) tellRevision(ctx context.Context) error {
	return s.tellParameters(ctx, []string{revisionParameter}, "")
}

// setParameters shows another revision. A wrong value is a problem, and changes nothing.
func (s *session) setParameters(ctx context.Context, set []parameter, id string) error {
	var names []string
	for _, parameter := range set {
		names = append(names, parameter.Name)
		if err := s.trySet(ctx, parameter); err != nil {
			return err
		}
	}
	if id != "" && len(names) > 0 {
		if err := s.tellParameters(ctx, names, id); err != nil {
			return err
		}
	}
	// Setting one of the parameters may change another.
	changed := slices.DeleteFunc([]string{asOfRevisionParameter, asOfTimeParameter},
		func(name string) bool { return !s.wanted[name] })
	if len(changed) == 0 {
		return nil
	}
	return s.tellParameters(ctx, changed, "")
}

// trySet sets a parameter, or tells the client why not.
func (s *session) trySet(ctx context.Context, set parameter) error {
	if set.Name != asOfRevisionParameter && set.Name != asOfTimeParameter {
		return s.warn(ctx, fmt.Sprintf("the parameter %.40q can't be set; %s and %s can",
			set.Name, asOfRevisionParameter, asOfTimeParameter))
	}
	if err := s.setParameter(ctx, set); err != nil {
		return s.tellProblem(ctx, set.Name, err)
	}
	return s.solved(ctx, set.Name)
}

// setParameter shows the revision that a parameter selects, if the server has it.
func (s *session) setParameter(ctx context.Context, set parameter) error {
	asked, err := selectionOf(set)
	if err != nil {
		return err
	}
	if asked == nil {
		s.show(asOf{})
		return nil
	}
	found, err := s.caller.Names(ctx, s.scope(), asked)
	if err != nil {
		return err
	}
	shown := asOf{selected: mapserver.At(found.GetRevision()), revision: found.GetRevision()}
	if set.Name == asOfTimeParameter {
		shown.time, _ = set.Value.(string)
	}
	s.show(shown)
	return nil
}

// selectionOf returns the revision that a parameter selects in a question to the server, or nil for the newest.
func selectionOf(set parameter) (*pb.AsOf, error) {
	if set.Name == asOfRevisionParameter {
		revision, ok := set.Value.(float64)
		if !ok || revision != math.Trunc(revision) || revision < 0 || revision > 1<<53 {
			return nil, errors.New("not a revision: a whole number, 0 for the newest")
		}
		if revision == 0 {
			return nil, nil
		}
		return mapserver.At(int64(revision)), nil
	}
	text, ok := set.Value.(string)
	if !ok {
		return nil, errors.New("not a text")
	}
	if text == "" {
		return nil, nil
	}
	moment, err := time.Parse(time.RFC3339, text)
	if err != nil {
		return nil, errors.New("not a time like 2026-05-07T08:09:10Z")
	}
	return &pb.AsOf{AsOf: &pb.AsOf_AtTime{AtTime: timestamppb.New(moment)}}, nil
}

// show makes everything due at another revision.
func (s *session) show(shown asOf) {
	s.asOf = shown
	s.list = paced{isDue: true}
	for _, channel := range s.channels {
		channel.paced = paced{isDue: true}
	}
}
