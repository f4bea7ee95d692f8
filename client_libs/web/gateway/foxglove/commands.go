package foxglove

import (
	"context"
	"fmt"
)

// obey carries out a command of the client.
func (s *session) obey(ctx context.Context, asked command) error {
	switch asked.Op {
	case "subscribe":
		return s.subscribe(ctx, asked.Subscriptions)
	case "unsubscribe":
		return s.unsubscribe(ctx, asked.SubscriptionIDs)
	case "getParameters":
		return s.tellParameters(ctx, asked.ParameterNames, asked.ID)
	case "setParameters":
		return s.setParameters(ctx, asked.Parameters, asked.ID)
	case "subscribeParameterUpdates":
		for _, name := range parameterNames(asked.ParameterNames) {
			s.wanted[name] = true
		}
		return nil
	case "unsubscribeParameterUpdates":
		for _, name := range parameterNames(asked.ParameterNames) {
			delete(s.wanted, name)
		}
		return nil
	}
	return s.warn(ctx, fmt.Sprintf("the gateway does not know the operation %.40q", asked.Op))
}

// subscribe begins to send channels, each with what it shows now.
func (s *session) subscribe(ctx context.Context, wanted []subscription) error {
	for _, subscription := range wanted {
		channel := s.find(subscription.ChannelID)
		var wrong string
		switch {
		case channel == nil:
			wrong = fmt.Sprintf("there is no channel %d", subscription.ChannelID)
		case channel.subscription != nil:
			wrong = fmt.Sprintf("channel %d has a subscription already", subscription.ChannelID)
		case s.subscriptions[subscription.ID] != nil:
			wrong = fmt.Sprintf("subscription %d is in use already", subscription.ID)
		}
		if wrong != "" {
			if err := s.warn(ctx, wrong); err != nil {
				return err
			}
			continue
		}
		id := subscription.ID
		channel.subscription, channel.isDue = &id, true
		s.subscriptions[id] = channel
	}
	return nil
}

func (s *session) unsubscribe(ctx context.Context, ids []uint32) error {
	for _, id := range ids {
		channel := s.subscriptions[id]
		if channel == nil {
			continue
		}
		channel.subscription = nil
		delete(s.subscriptions, id)
		if err := s.solved(ctx, channel.topic); err != nil {
			return err
		}
	}
	return nil
}

func (s *session) find(id uint32) *channel {
	for _, channel := range s.channels {
		if channel.id == id {
			return channel
		}
	}
	return nil
}
