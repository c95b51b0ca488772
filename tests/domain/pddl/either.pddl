; parameters of one of two types
(define (domain either)
  (:requirements :strips :typing :negative-preconditions)
  (:types crate drum pallet dock - object
          small-crate - crate)
  (:predicates (at ?x - (either crate drum) ?d - dock) (on ?x - (either drum crate) ?p - pallet)
               (stable ?p - pallet))
  (:action load
    :parameters (?x - (either crate drum) ?p - pallet ?d - dock)
    :precondition (and (at ?x ?d) (stable ?p))
    :effect (and (on ?x ?p) (not (at ?x ?d))))
  (:action strap
    :parameters (?p - pallet)
    :precondition (not (stable ?p))
    :effect (stable ?p))
  (:action clear
    :parameters (?p - pallet ?d - dock)
    :precondition (exists (?x - (either crate drum)) (on ?x ?p))
    :effect (forall (?x - (either crate drum))
              (when (on ?x ?p) (and (at ?x ?d) (not (on ?x ?p)))))))
