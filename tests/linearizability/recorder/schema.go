package recorder

import (
	_ "embed"
	"encoding/json"
	"fmt"

	"google.golang.org/protobuf/encoding/protojson"
	"google.golang.org/protobuf/proto"
	"google.golang.org/protobuf/reflect/protodesc"
	"google.golang.org/protobuf/reflect/protoreflect"
	"google.golang.org/protobuf/reflect/protoregistry"
	"google.golang.org/protobuf/types/descriptorpb"
	"google.golang.org/protobuf/types/dynamicpb"
)

// descriptorSet describes all files of the project's proto folder. build.sh generates it with protoc.
//
//go:embed schema/hypermap.binpb
var descriptorSet []byte

// schema finds the rpcs of the protocol by their names.
type schema struct{ files *protoregistry.Files }

func loadSchema() (*schema, error) {
	var set descriptorpb.FileDescriptorSet
	if err := proto.Unmarshal(descriptorSet, &set); err != nil {
		return nil, fmt.Errorf("the embedded schema: %w", err)
	}
	files, err := protodesc.NewFiles(&set)
	if err != nil {
		return nil, fmt.Errorf("the embedded schema: %w", err)
	}
	return &schema{files}, nil
}

// method returns an rpc, such as "QueryService.QueryPoint".
func (s *schema) method(name string) (protoreflect.MethodDescriptor, error) {
	found, err := s.files.FindDescriptorByName(protoreflect.FullName("hypermap.v1." + name))
	if err != nil {
		return nil, fmt.Errorf("%s: %w", name, err)
	}
	method, ok := found.(protoreflect.MethodDescriptor)
	if !ok {
		return nil, fmt.Errorf("%s is not an rpc", name)
	}
	return method, nil
}

// encode makes a message from its fields, named as in Protobuf's JSON.
func encode(kind protoreflect.MessageDescriptor, fields object) (*dynamicpb.Message, error) {
	text, err := json.Marshal(fields)
	if err != nil {
		return nil, err
	}
	message := dynamicpb.NewMessage(kind)
	return message, protojson.Unmarshal(text, message)
}

// decode sets the fields of a struct from a message, by their names in Protobuf's JSON. Fields that
// the struct does not have are ignored.
func decode(message *dynamicpb.Message, fields any) error {
	text, err := protojson.Marshal(message)
	if err != nil {
		return err
	}
	return json.Unmarshal(text, fields)
}

// object is a JSON object.
type object = map[string]any
