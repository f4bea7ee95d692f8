package main

import (
	"net/netip"
	"sync"
)

// quota bounds the use of a resource, in total and for each address. An address may have a part of what the
// others leave of the total, so that many addresses together can't take all of it: with a part of a half,
// the first may have a half, and eight have eight ninths. Safe for concurrent use.
type quota struct {
	total        int64
	sharePercent int64
	// The most that an address may have when there is no other.
	share int64

	mu        sync.Mutex
	used      int64
	byAddress map[netip.Addr]int64
	// The highest use since the last time that fellFrom returned true.
	highest int64
}

// newQuota returns a quota of which each address may have a part, in percent.
func newQuota(total, sharePercent int64) *quota {
	q := &quota{total: total, sharePercent: sharePercent, byAddress: map[netip.Addr]int64{}}
	q.share = q.shareOf(total)
	return q
}

// shareOf returns the part of an amount that an address may have, at least 1.
func (q *quota) shareOf(amount int64) int64 {
	return max(amount/100*q.sharePercent+amount%100*q.sharePercent/100, 1)
}

// take takes an amount for the address. If that much is not free, it takes nothing and returns false.
func (q *quota) take(address netip.Addr, amount int64) bool {
	q.mu.Lock()
	defer q.mu.Unlock()
	held := q.byAddress[address]
	others := q.used - held
	if amount > q.total-q.used || amount > q.shareOf(q.total-others)-held {
		return false
	}
	q.used += amount
	q.highest = max(q.highest, q.used)
	q.byAddress[address] += amount
	return true
}

// release gives back an amount that was taken for the address.
func (q *quota) release(address netip.Addr, amount int64) {
	q.mu.Lock()
	defer q.mu.Unlock()
	q.used -= amount
	if q.byAddress[address] -= amount; q.byAddress[address] <= 0 {
		delete(q.byAddress, address)
	}
}

// fellFrom returns whether the use has been at least `peak` and is now at most an eighth of its highest value.
// It returns true once for each peak.
func (q *quota) fellFrom(peak int64) bool {
	q.mu.Lock()
	defer q.mu.Unlock()
	if q.highest < peak || q.used > q.highest/8 {
		return false
	}
	q.highest = q.used
	return true
}

// addressOf returns the address to which the use of a connection counts. An IPv6 network of 64 bits
// counts as one address, because a single machine can use all addresses of its network.
func addressOf(remote string) netip.Addr {
	parsed, err := netip.ParseAddrPort(remote)
	if err != nil {
		return netip.Addr{}
	}
	address := parsed.Addr().Unmap().WithZone("")
	if address.Is6() {
		return netip.PrefixFrom(address, 64).Masked().Addr()
	}
	return address
}
