; constants of two types, and = with one of them
(define (domain coffee)
  (:requirements :strips :typing :equality :negative-preconditions)
  (:types cup place robot - object
          station - place)
  (:constants kitchen-desk - place coffee-machine - station robby - robot)
  (:predicates (at ?x - (either cup robot) ?p - place) (carries ?r - robot ?c - cup) (full ?c - cup)
               (busy ?r - robot))
  (:action go
    :parameters (?r - robot ?from ?to - place)
    :precondition (and (at ?r ?from) (not (= ?from ?to)))
    :effect (and (at ?r ?to) (not (at ?r ?from))))
  (:action take
    :parameters (?c - cup ?p - place)
    :precondition (and (at ?c ?p) (at robby ?p) (not (busy robby)))
    :effect (and (carries robby ?c) (busy robby) (not (at ?c ?p))))
  (:action set-down
    :parameters (?c - cup ?p - place)
    :precondition (and (carries robby ?c) (at robby ?p))
    :effect (and (at ?c ?p) (not (busy robby)) (not (carries robby ?c))))
  (:action brew
    :parameters (?c - cup)
    :precondition (and (carries robby ?c) (at robby coffee-machine) (not (full ?c)))
    :effect (full ?c)))
