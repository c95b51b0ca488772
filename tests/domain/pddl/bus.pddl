; a predicate with three arguments, one that relates a thing to itself, several digits in names
(define (domain bus)
  (:requirements :strips :typing :negative-preconditions)
  (:types bus stop line1 rider)
  (:predicates (route1 ?l - line1 ?a ?b - stop) (serves2 ?b - bus ?l - line1) (at ?b - bus ?s - stop)
               (waits ?r - rider ?s - stop) (rides ?r - rider ?b - bus) (same-stop ?a ?b - stop))
  (:action drive
    :parameters (?b - bus ?l - line1 ?from ?to - stop)
    :precondition (and (serves2 ?b ?l) (route1 ?l ?from ?to) (at ?b ?from)
                       (not (same-stop ?from ?to)))
    :effect (and (at ?b ?to) (not (at ?b ?from))))
  (:action get-on
    :parameters (?r - rider ?b - bus ?s - stop)
    :precondition (and (waits ?r ?s) (at ?b ?s))
    :effect (and (rides ?r ?b) (not (waits ?r ?s))))
  (:action get-off
    :parameters (?r - rider ?b - bus ?s - stop)
    :precondition (and (rides ?r ?b) (at ?b ?s))
    :effect (and (waits ?r ?s) (not (rides ?r ?b)))))
